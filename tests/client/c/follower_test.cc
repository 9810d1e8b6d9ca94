// The part of the Unreal sample that knows no engine, against a real server.

#include "client/unreal/lpdeform_follower.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/client/in_process_server.h"

namespace lpdeform {
namespace {

/// z of the normal as Unreal's GeometryCore has it (VectorUtil::Normal): (C - A) x (B - A).
double unreal_normal_z(const std::vector<float>& positions, std::uint32_t a, std::uint32_t b,
                       std::uint32_t c) {
  const auto edge = [&](std::uint32_t to, int k) { return positions[3 * to + k] - positions[3 * a + k]; };
  return edge(c, 0) * edge(b, 1) - edge(c, 1) * edge(b, 0);
}

TEST(UnrealFollower, FollowsAHandleInCentimetres) {
  const client::InProcessServer server;
  // A strip in the plane z = 0 that looks up.
  std::vector<float> positions;
  std::vector<std::uint32_t> indices;
  for (int k = 0; k <= 10; ++k) {
    for (const float y : {0.0F, 100.0F})
      positions.insert(positions.end(), {100.0F * static_cast<float>(k), y, 0});
  }
  for (std::uint32_t k = 0; k < 20; k += 2) {
    for (const std::uint32_t corner : {0U, 3U, 2U, 0U, 1U, 3U}) indices.push_back(k + corner);
  }
  ASSERT_GT(unreal_normal_z(positions, indices[0], indices[1], indices[2]), 0);
  LpdeformFollower follower(server.address(), positions, indices);
  EXPECT_TRUE(follower.hold("base", {0, 1}));
  EXPECT_TRUE(follower.hold("tip", {20, 21}));
  EXPECT_TRUE(follower.move("tip", {0, 0, 0, 1}, {0, 0, 200}));
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  bool has_followed = false;
  while (!has_followed && std::chrono::steady_clock::now() < deadline) {  // a game's ticks
    if (!follower.tick()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    has_followed = follower.positions()[3 * 20 + 2] == 200;
  }
  EXPECT_TRUE(has_followed) << follower.problem();
  EXPECT_EQ(follower.state(), LPDEFORM_STATE_LIVE);
  EXPECT_GT(follower.normals()[2], 0);  // the base looks up still
  EXPECT_EQ(follower.problem(), "");
  follower.hold("nothing", {});  // refused by the server, and said by a later tick
  std::string problem;
  while (problem.empty() && std::chrono::steady_clock::now() < deadline) {
    follower.tick();
    problem = follower.problem();
  }
  EXPECT_NE(problem.find("HANDLE_EMPTY"), std::string::npos) << problem;
}

}  // namespace
}  // namespace lpdeform
