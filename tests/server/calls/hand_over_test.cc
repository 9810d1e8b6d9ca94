// Two servers with one Redis: a caller with the session's route gets the session from a server that does not have it; a caller
// with another route does not.

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "redis_server.h"
#include "restart_fixture.h"
#include "server/keeping/keeper.h"
#include "server/store/redis_store.h"

namespace lpdeform {
namespace {

class HandOverCallsTest : public RestartTest {
 protected:
  HandOverCallsTest() { timers_.reset(); }  // leases end by the time of Redis

  void SetUp() override {
    ServerOptions options = options_;
    for (ServerOptions* const one : {&options_, &options}) {
      auto store = open_redis_store(
          {.host = "127.0.0.1", .port = redis_.port(), .lease = kLease, .patience = kPatience});
      ASSERT_TRUE(store.ok()) << store.status();
      one->store = *std::move(store);
    }
    start();
    auto server = Server::start(options);
    ASSERT_TRUE(server.ok()) << server.status();
    other_server_ = *std::move(server);
    other_ = v1::DeformService::NewStub(
        grpc::CreateChannel(other_server_->address(), grpc::InsecureChannelCredentials()));
  }
  ~HandOverCallsTest() override {  // while there is a Redis
    other_server_.reset();
    server_.reset();
    options_.store.reset();
  }

  /// A way of "": without the header.
  v1::CreateSessionResponse create_by(const std::string& way) {
    grpc::ClientContext context;
    if (!way.empty()) context.AddMetadata("lpdeform-session", way);
    v1::CreateSessionResponse response;
    v1::CreateSessionRequest request;
    *request.mutable_mesh() = mesh_message(mesh_);
    EXPECT_TRUE(stub_->CreateSession(&context, request, &response).ok());
    return response;
  }

  static grpc::Status get_by(const std::string& way, v1::DeformService::Stub& stub, const std::string& name,
                             v1::Session& session) {
    grpc::ClientContext context;
    if (!way.empty()) context.AddMetadata("lpdeform-session", way);
    v1::GetSessionRequest request;
    request.set_session(name);
    v1::GetSessionResponse response;
    const grpc::Status status = stub.GetSession(&context, request, &response);
    session = response.session();
    return status;
  }

  /// Longer than usual, because a holder that is held up for two thirds of a lease may lose its sessions.
  static constexpr std::chrono::milliseconds kLease{3900}, kPatience{6500};
  const TriangleMesh mesh_ = bar_mesh();
  RedisServer redis_{folder_};
  std::unique_ptr<Server> other_server_;
  std::unique_ptr<v1::DeformService::Stub> other_;
};

TEST_F(HandOverCallsTest, InTheMiddleOfADragNoUpdateIsRefusedAndNoneThatWasKeptIsLost) {
  const auto session = create_by("the way");
  const std::string name = session.session().name();
  ASSERT_TRUE(keeps(session, ends_message(mesh_.vertices, 1, 1)));
  DeformClient stream(*stub_, session);
  std::thread dragging([&] {
    for (std::uint64_t seq = 2; stream.send(tip_message(seq, 0.001 * static_cast<double>(seq % 1000)));
         ++seq) {
    }
  });
  v1::Session found;
  grpc::Status given;
  std::thread asking([&] {
    const auto end = std::chrono::steady_clock::now() + kTestDeadline;
    do given = get_by("the way", *other_, name, found);
    while (given.error_code() == grpc::StatusCode::UNAVAILABLE && std::chrono::steady_clock::now() < end);
  });
  EXPECT_TRUE(stream.read_to_end().ok());
  dragging.join();
  asking.join();
  ASSERT_TRUE(given.ok()) << given.error_message();
  ASSERT_EQ(stream.history.ends.size(), 1u);
  EXPECT_EQ(stream.history.ends[0].reason(), v1::GO_AWAY_REASON_DRAINING);
  EXPECT_TRUE(stream.history.faults.empty());
  std::uint64_t kept = 1;
  for (const v1::UpdateResult& result : stream.history.results) {
    if (result.kept()) kept = std::max(kept, result.input_seq());
  }
  EXPECT_GE(found.input_seq(), kept);
  EXPECT_GT(found.epoch(), session.session().epoch());
  v1::Session misrouted;
  const grpc::Status elsewhere = get_by("another way", *stub_, name, misrouted);
  EXPECT_EQ(details_of(elsewhere).info.reason(), "SESSION_ELSEWHERE");
}

/// Whose maker said a way, or none.
class LookFromElsewhereTest : public HandOverCallsTest, public testing::WithParamInterface<const char*> {
 protected:
  /// What the other server tells a caller, once it reaches Redis.
  ErrorDetails look_from_elsewhere(const v1::CreateSessionResponse& session) {
    const auto end = std::chrono::steady_clock::now() + kTestDeadline;
    v1::Session found;
    ErrorDetails refusal;
    do refusal = details_of(get_by("", *other_, session.session().name(), found));
    while (refusal.info.reason() == "STORE_FAILING" && std::chrono::steady_clock::now() < end);
    return refusal;
  }
};

INSTANTIATE_TEST_SUITE_P(MadeBy, LookFromElsewhereTest, testing::Values("the way", ""),
                         [](const auto& info) { return *info.param == '\0' ? "NoWay" : "AWay"; });

TEST_P(LookFromElsewhereTest, DoesNotEndADragThatRests) {
  const auto session = create_by(GetParam());
  DeformClient stream(*stub_, session);
  ASSERT_TRUE(stream.send(ends_message(mesh_.vertices, 1, 1)));
  ASSERT_TRUE(stream.settle(1).has_value());
  // For longer than the session counts as in use after a call, and than a lease that is not renewed.
  const auto end = std::chrono::steady_clock::now() + 2 * (Keeper::kInUse + kLease);
  do {
    const ErrorDetails refusal = look_from_elsewhere(session);
    EXPECT_EQ(refusal.info.reason(), "SESSION_ELSEWHERE");
    EXPECT_TRUE(refusal.retry.has_value());
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // with a way, a look is answered at once
  } while (std::chrono::steady_clock::now() < end);
  ASSERT_TRUE(stream.send(tip_message(2, 1.5)));
  EXPECT_TRUE(stream.settle(2).has_value());
  EXPECT_TRUE(stream.history.ends.empty());
}

/// Redis hangs, as when its disk does: for longer than a lease, and for longer than servers wait for an answer.
TEST_P(LookFromElsewhereTest, DoesNotEndADragThatRestsWhileRedisHangs) {
  const auto session = create_by(GetParam());
  DeformClient stream(*stub_, session);
  ASSERT_TRUE(stream.send(ends_message(mesh_.vertices, 1, 1)));
  ASSERT_TRUE(stream.settle(1).has_value());
  for (const std::chrono::milliseconds hangs : {kLease * 5 / 4, kLease * 5 / 4, kPatience * 3 / 2}) {
    redis_.pause();
    std::thread resuming([&] {
      std::this_thread::sleep_for(hangs);
      redis_.resume();
    });
    v1::Session found;
    get_by("", *other_, session.session().name(), found);
    resuming.join();
    EXPECT_EQ(look_from_elsewhere(session).info.reason(), "SESSION_ELSEWHERE");
  }
  ASSERT_TRUE(stream.send(tip_message(2, 1.5)));
  EXPECT_TRUE(stream.settle(2).has_value());
  EXPECT_TRUE(stream.history.ends.empty());
}

}  // namespace
}  // namespace lpdeform
