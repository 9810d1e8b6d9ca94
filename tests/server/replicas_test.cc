// Several servers that share a store in Redis, behind Envoy: a server that dies or drains hands over, and the C++ client
// continues by itself. LPDEFORM_VERTICES chooses a mesh of about that many vertices; then the time of a failover is printed.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "bar.h"
#include "client/cpp/client.h"
#include "program.h"
#include "redis_server.h"
#include "server/admin/health_probe.h"

#include <httplib.h>  // after Eigen, because resolv.h defines a macro of the name _res

namespace lpdeform {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::seconds kPatience{60};

double seconds_since(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

class ReplicasTest : public testing::Test {
 protected:
  ReplicasTest() {
    char name[] = "/tmp/lpdeform-replicas-XXXXXX";
    folder_ = mkdtemp(name);
    redis_ = std::make_unique<RedisServer>(folder_);
    for (std::size_t k = 0; k < 3; ++k) {
      addresses_.push_back("127.0.0.1:0");
      servers_.push_back(nullptr);
      begin(k);
    }
    web_ = absl::StrCat("127.0.0.1:", free_port());
    envoy_ = std::make_unique<Program>(
        std::vector<std::string>{"--web", web_, "--server", absl::StrJoin(addresses_, ","), "--files", "none",
                                 "--access-log", folder_ + "/access.log", "--admin-file", folder_ + "/admin"},
        std::vector<std::string>{}, LPDEFORM_WEB_PROGRAM);
    wait_for_envoy();
  }

  ~ReplicasTest() override {
    envoy_.reset();
    servers_.clear();
    redis_.reset();
    std::filesystem::remove_all(folder_);
  }

  /// Starts the server at its address, for the first time at a free one.
  void begin(std::size_t k) {
    servers_[k] = std::make_unique<Program>(std::vector<std::string>{
        "--address", addresses_[k], "--store", absl::StrCat("redis://127.0.0.1:", redis_->port()),
        "--log-level", "off", "--grace", "10"});
    addresses_[k] = servers_[k]->address();
    ASSERT_TRUE(is_serving(addresses_[k]));
  }

  /// Until Envoy knows that all servers are well.
  void wait_for_envoy() const {
    const auto end = Clock::now() + kPatience;
    for (;;) {
      std::string address;
      std::ifstream(folder_ + "/admin") >> address;
      const httplib::Result result =
          httplib::Client("http://" + address).Get("/stats?filter=^cluster.lpdeform.membership_healthy$");
      if (result &&
          result->body == absl::StrCat("cluster.lpdeform.membership_healthy: ", servers_.size(), "\n"))
        return;
      if (Clock::now() > end) throw std::runtime_error(result ? result->body : "Envoy does not answer.");
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  /// Of a client of its own, once Envoy lets it reach a server.
  client::Session open(const client::Mesh& mesh) {
    const auto end = Clock::now() + kPatience;
    for (;;) {
      auto client = client::Client::connect(web_);
      auto session = client.ok() ? client->open(mesh) : client.status();
      if (session.ok()) return *std::move(session);
      if (Clock::now() > end) throw std::runtime_error(session.status().ToString());
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  static client::Mesh bar(int length) { return mesh_of(box_surface(4, 4, length)); }
  static client::Mesh cube(double vertices) {
    const int cells = std::max(1, static_cast<int>(std::lround(std::sqrt(vertices / 6))));
    return mesh_of(box_surface(cells, cells, cells));
  }
  static client::Mesh mesh_of(const TriangleMesh& box) {
    return {{box.vertices.data(), box.vertices.data() + box.vertices.size()},
            {box.faces.data(), box.faces.data() + box.faces.size()}};
  }

  /// Holds both ends; the tip is handle "tip".
  static void hold(client::Session& session, const client::Mesh& mesh) {
    std::vector<std::uint32_t> base, tip;
    const auto n = static_cast<std::uint32_t>(mesh.vertices.size() / 3);
    double highest = 0;
    for (std::uint32_t v = 0; v < n; ++v) highest = std::max(highest, mesh.vertices[3 * v + 2]);
    for (std::uint32_t v = 0; v < n; ++v) {
      if (mesh.vertices[3 * v + 2] < 1e-9) base.push_back(v);
      if (mesh.vertices[3 * v + 2] > highest - 1e-9) tip.push_back(v);
    }
    ASSERT_TRUE(session.set_handle("base", {.vertices = base}).ok());
    ASSERT_TRUE(session.set_handle("tip", {.vertices = tip}).ok());
  }

  static absl::Status move(client::Session& session, double x) {
    const auto moved = session.move("tip", client::RigidMotion{.translation = {x, 0, 0}});
    return moved.ok() ? session.settle(kPatience).status() : moved.status();
  }

  std::string folder_;
  std::unique_ptr<RedisServer> redis_;
  std::vector<std::string> addresses_;
  std::vector<std::unique_ptr<Program>> servers_;
  std::string web_;
  std::unique_ptr<Program> envoy_;
};

TEST_F(ReplicasTest, ASessionOutlivesEveryServerThatDies) {
  const char* const vertices = std::getenv("LPDEFORM_VERTICES");
  const client::Mesh mesh = vertices == nullptr ? bar(21) : cube(std::atof(vertices));
  const Clock::time_point making = Clock::now();
  client::Session session = open(mesh);
  hold(session, mesh);
  const absl::Status first = move(session, 0.5);
  ASSERT_TRUE(first.ok()) << first;
  const double setup = seconds_since(making);
  const std::string name = session.name();
  std::vector<double> times;
  for (std::size_t k = 0; k < servers_.size(); ++k) {
    servers_[k]->signal(SIGKILL);
    servers_[k]->wait();
    const Clock::time_point dead = Clock::now();
    const absl::Status moved = move(session, 1 + 0.25 * static_cast<double>(k));
    ASSERT_TRUE(moved.ok()) << moved;
    times.push_back(seconds_since(dead));
    begin(k);
  }
  EXPECT_EQ(session.name(), name);  // it was not recreated
  std::printf("%zu vertices: open to first result %.2f s; kill -9 to the next result, for each server:",
              mesh.vertices.size() / 3, setup);
  for (const double time : times) std::printf(" %.2f", time);
  std::printf(" s\n");
}

/// Whichever dies: each time the only one, because Envoy takes a second or two to see that one is back.
class OneOfThreeDiesTest : public ReplicasTest, public testing::WithParamInterface<std::size_t> {};

INSTANTIATE_TEST_SUITE_P(Each, OneOfThreeDiesTest, testing::Values(0, 1, 2));

TEST_P(OneOfThreeDiesTest, NoNewClientIsSentToAServerThatHasJustDied) {
  const client::Mesh mesh = bar(3);
  const client::Session first = open(mesh);
  servers_[GetParam()]->signal(SIGKILL);
  servers_[GetParam()]->wait();
  for (int other = 0; other < 10; ++other) {  // each by a way of its own, of which a third lead there
    auto client = client::Client::connect(web_);
    ASSERT_TRUE(client.ok()) << client.status();
    const auto session = client->open(mesh);
    EXPECT_TRUE(session.ok()) << session.status();
  }
}

TEST_F(ReplicasTest, ARollingRestartUnderLoadLosesNoSession) {
  const client::Mesh mesh = bar(21);
  std::vector<client::Session> sessions;
  std::vector<std::string> names;
  for (int k = 0; k < 6; ++k) {
    sessions.push_back(open(mesh));
    hold(sessions.back(), mesh);
    names.push_back(sessions.back().name());
  }
  std::atomic<bool> is_over = false;
  std::vector<std::thread> threads;
  std::vector<double> longest(sessions.size());
  std::vector<absl::Status> results(sessions.size());
  for (std::size_t k = 0; k < sessions.size(); ++k) {
    threads.emplace_back([&, k] {
      for (int step = 1; !is_over && results[k].ok(); ++step) {
        const Clock::time_point begin = Clock::now();
        results[k] = move(sessions[k], 0.01 * (step % 100));
        longest[k] = std::max(longest[k], seconds_since(begin));
      }
    });
  }
  for (std::size_t k = 0; k < servers_.size(); ++k) {
    servers_[k]->signal(SIGTERM);
    EXPECT_EQ(servers_[k]->wait(), 0);
    begin(k);
  }
  is_over = true;
  for (std::thread& thread : threads) thread.join();
  for (std::size_t k = 0; k < sessions.size(); ++k) {
    EXPECT_TRUE(results[k].ok()) << results[k];
    EXPECT_EQ(sessions[k].name(), names[k]);
  }
  std::printf("rolling restart of %zu servers: %zu sessions, 0 lost, the longest wait for a result %.2f s\n",
              servers_.size(), sessions.size(), *std::max_element(longest.begin(), longest.end()));
}

/// Who looks on, by a client of their own.
absl::StatusOr<client::Session> join(const std::string& address, const std::string& name) {
  auto client = client::Client::connect(address);
  return client.ok() ? client->join(name, client::Role::kReader) : client.status();
}

TEST_F(ReplicasTest, UsersOfOneSessionMeetAtOneServer) {
  const client::Mesh mesh = bar(21);
  client::Session session = open(mesh);
  hold(session, mesh);
  const std::string name = session.name();
  std::atomic<bool> is_over = false;
  absl::Status moved;
  std::thread dragging([&] {
    for (int step = 1; !is_over && moved.ok(); ++step) moved = move(session, 0.01 * (step % 100));
  });
  const auto others_see_it = [&] {
    for (int k = 0; k < 6; ++k) {  // each by a way of its own, of which two thirds lead elsewhere
      auto other = join(web_, name);
      ASSERT_TRUE(other.ok()) << other.status();
      absl::StatusOr<client::Frame> frame;
      do frame = other->next_frame(kPatience);
      while (frame.ok() && frame->input_seq == 0);  // of a session that was just made again
      EXPECT_TRUE(frame.ok()) << frame.status();
      const auto file = client::Client::connect(web_)->snapshot(name);  // by a way of its own again
      EXPECT_TRUE(file.ok()) << file.status();
    }
  };
  others_see_it();
  for (std::size_t k = 0; k < servers_.size(); ++k) {  // and where it is after servers have come and gone
    servers_[k]->signal(SIGTERM);
    EXPECT_EQ(servers_[k]->wait(), 0);
    begin(k);
    others_see_it();
  }
  is_over = true;
  dragging.join();
  EXPECT_TRUE(moved.ok()) << moved;
  EXPECT_EQ(session.name(), name);
}

TEST_F(ReplicasTest, WhoLooksOnDoesNotMoveASessionThatNobodyChangesAtTheMoment) {
  const client::Mesh mesh = bar(21);
  (void)open(mesh);
  std::this_thread::sleep_for(
      std::chrono::seconds(2));  // until Envoy has all servers: ways change while they come
  client::Session session = open(mesh);
  hold(session, mesh);
  ASSERT_TRUE(session.move("tip", client::RigidMotion{.translation = {0.5, 0, 0}}).ok());
  const auto before = session.settle(kPatience);
  ASSERT_TRUE(before.ok()) << before.status();
  std::this_thread::sleep_for(
      std::chrono::milliseconds(2500));  // longer than a session counts as in use after a call
  for (int k = 0; k < 6; ++k) {
    auto other = join(web_, session.name());
    ASSERT_TRUE(other.ok()) << other.status();
    const auto frame = other->next_frame(kPatience);
    ASSERT_TRUE(frame.ok()) << frame.status();
    EXPECT_EQ(frame->epoch, before->epoch);
  }
}

}  // namespace
}  // namespace lpdeform
