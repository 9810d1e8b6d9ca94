// The part of the engines' components that knows no engine, against a real server.

#include "client/c/lpdeform_follower.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <thread>

#include "core/shapes/shapes.h"
#include "tests/client/servers.h"

namespace lpdeform {
namespace {

/// z of the normal as Unreal's GeometryCore has it (VectorUtil::Normal): (C - A) x (B - A).
double unreal_normal_z(const std::vector<float>& positions, std::uint32_t a, std::uint32_t b,
                       std::uint32_t c) {
  const auto edge = [&](std::uint32_t to, int k) { return positions[3 * to + k] - positions[3 * a + k]; };
  return edge(c, 0) * edge(b, 1) - edge(c, 1) * edge(b, 0);
}

TEST(Follower, FollowsAHandleInCentimetres) {
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
  LpdeformFollower follower({server.address()}, kUnrealSpace, {positions, {}, indices});
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

/// A bar of which one end is turned by 80 degrees. The first minimum that the solver comes to is 2.8 % above another one.
class FollowerOfABentBar : public testing::Test {
 protected:
  FollowerOfABentBar() {
    const TriangleMesh bar = box_surface(6, 6, 40);
    std::vector<float> positions;
    std::vector<std::uint32_t> bottom, top;
    for (std::uint32_t v = 0; v < bar.vertices.rows(); ++v) {
      for (int k = 0; k < 3; ++k) positions.push_back(static_cast<float>(100 * bar.vertices(v, k)));
      if (bar.vertices(v, 2) == 0) bottom.push_back(v);
      if (bar.vertices(v, 2) == 40) top.push_back(v);
    }
    const std::vector<std::uint32_t> indices(bar.faces.data(), bar.faces.data() + bar.faces.size());
    follower_ = std::make_unique<LpdeformFollower>(LpdeformServer{server_.address()}, kUnrealSpace,
                                                   LpdeformShape{positions, {}, indices});
    EXPECT_TRUE(follower_->hold("bottom", bottom));
    EXPECT_TRUE(follower_->hold("top", top));
    // About the line through (300, 300, 2000) along x.
    const double angle = 80 * std::numbers::pi / 180, c = std::cos(angle), s = std::sin(angle);
    EXPECT_TRUE(follower_->move("top", {std::sin(angle / 2), 0, 0, std::cos(angle / 2)},
                                {0, 300 - 300 * c + 2000 * s, 2000 - 300 * s - 2000 * c}));
  }

  bool tick_until(const std::function<bool()>& holds) {
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!holds()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
      if (!follower_->tick()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return true;
  }

  const client::InProcessServer server_;
  std::unique_ptr<LpdeformFollower> follower_;
};

TEST_F(FollowerOfABentBar, ShowsABetterShapeWhereThatIsAskedFor) {
  EXPECT_TRUE(follower_->set(1.5, {.shows = true}));
  const auto is_result = [this] {
    return follower_->frame().is_final == 1 && follower_->frame().input_seq == 4;
  };
  ASSERT_TRUE(tick_until(is_result)) << follower_->problem();
  const double first = follower_->frame().energy;
  ASSERT_TRUE(tick_until([&] { return is_result() && follower_->frame().energy < 0.98 * first; }));
  EXPECT_EQ(follower_->notice(), "");
}

TEST_F(FollowerOfABentBar, SaysOnceThatABetterShapeIsKnownAndTakesIt) {
  EXPECT_FALSE(follower_->take_better_shape());
  EXPECT_FALSE(follower_->problem().empty());
  EXPECT_TRUE(follower_->set(1.5, {}));
  std::string said;
  const auto says_it = [&] { return (said = follower_->notice()).find("energy") != std::string::npos; };
  ASSERT_TRUE(tick_until(says_it)) << said << follower_->problem();
  EXPECT_EQ(follower_->notice(), "");
  const double first = follower_->frame().energy;
  ASSERT_TRUE(follower_->take_better_shape()) << follower_->problem();
  EXPECT_TRUE(tick_until([&] { return follower_->frame().energy < 0.98 * first; }));
}

TEST_F(FollowerOfABentBar, LooksNoFartherThanItIsTold) {
  std::string problem;
  const auto is_refused = [&] { return !(problem = follower_->problem()).empty(); };
  std::uint64_t changes =
      3;  // those that hold and move the bar, which are sent before others can be refused together with them
  const auto is_result = [&] {
    return follower_->frame().is_final == 1 && follower_->frame().input_seq == changes;
  };
  ASSERT_TRUE(tick_until(is_result));
  EXPECT_TRUE(follower_->set(1.5, {.effort = 1001}));  // the server refuses it later
  ASSERT_TRUE(tick_until(is_refused));
  EXPECT_NE(problem.find("1001"), std::string::npos) << problem;
  EXPECT_TRUE(follower_->set(1.5, {.least_share = 1.5}));
  ASSERT_TRUE(tick_until(is_refused));
  EXPECT_NE(problem.find("1.5"), std::string::npos) << problem;
  changes = 5;
  // No shape saves this share, and then no start is made. A shape that saves the usual share is found in about a second.
  for (const LpdeformSearch& little :
       {LpdeformSearch{.shows = true, .least_share = 0.5}, LpdeformSearch{.shows = true, .effort = 0}}) {
    EXPECT_TRUE(follower_->set(1.5, little));
    ++changes;
    ASSERT_TRUE(tick_until(is_result)) << follower_->problem();
    const double first = follower_->frame().energy;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(4);
    while (std::chrono::steady_clock::now() < end) {
      if (!follower_->tick()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      ASSERT_GT(follower_->frame().energy, 0.98 * first);
      ASSERT_EQ(follower_->notice(), "");
    }
  }
}

}  // namespace
}  // namespace lpdeform
