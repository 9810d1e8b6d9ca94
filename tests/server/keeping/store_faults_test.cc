// A server whose store fails or hangs: what goes on, what is refused, and that no acknowledged update is lost.

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <future>
#include <thread>

#include "redis_server.h"
#include "restart_fixture.h"
#include "server/keeping/stored.pb.h"
#include "server/store/redis_store.h"

namespace lpdeform {
namespace {

class StoreFaultsTest : public RestartTest {
 protected:
  StoreFaultsTest() { timers_.reset(); }

  v1::CreateSessionRequest request() const {
    v1::CreateSessionRequest request;
    *request.mutable_mesh() = mesh_message(mesh_);
    return request;
  }

  /// Sends updates until one is kept again; the store has recovered then.
  std::uint64_t until_kept(const v1::CreateSessionResponse& session, std::uint64_t seq) {
    const auto end = std::chrono::steady_clock::now() + kTestDeadline;
    while (!take(session, tip_message(seq, 0.01 * static_cast<double>(seq))).kept()) {
      EXPECT_LT(std::chrono::steady_clock::now(), end);
      ++seq;
    }
    return seq;
  }

  /// As a client does that is told to try again: the store has to take something first to count as well again.
  template <typename Call>
  static grpc::Status again_and_again(const Call& call) {
    const auto end = std::chrono::steady_clock::now() + kTestDeadline;
    for (;;) {
      const grpc::Status status = call();
      if (status.error_code() != grpc::StatusCode::UNAVAILABLE || std::chrono::steady_clock::now() > end)
        return status;
    }
  }

  const TriangleMesh mesh_ = bar_mesh();
};

TEST_F(StoreFaultsTest, WhileItFailsADragGoesOnAndIsNotCalledKept) {
  const auto session = create(mesh_);
  v1::Update first = ends_message(mesh_.vertices, 1, 1);
  first.mutable_settings()->mutable_solver()->set_initial(
      v1::INITIAL_GUESS_LAPLACIAN);  // whatever came before
  ASSERT_TRUE(keeps(session, first));
  faults_->set_failing(true);
  DeformClient stream(*stub_, session);
  for (std::uint64_t seq = 2; seq < 12; ++seq) {
    ASSERT_TRUE(stream.send(tip_message(seq, 0.1 * static_cast<double>(seq))));
    ASSERT_TRUE(stream.settle(seq).has_value());
  }
  ASSERT_FALSE(stream.history.results.empty());
  for (const v1::UpdateResult& result : stream.history.results) EXPECT_FALSE(result.kept());

  faults_->set_failing(false);
  const std::uint64_t newest = until_kept(session, 12);
  const std::string before = seen(session), positions = solved(session);
  restart();  // with all of what the store had refused at first
  EXPECT_EQ(seen(session), before);
  EXPECT_TRUE(solved(session) == positions);
  v1::Session found;
  ASSERT_TRUE(get(session.session().name(), found).ok());
  EXPECT_EQ(found.input_seq(), newest);
}

TEST_F(StoreFaultsTest, HandlesThatWereForgottenWhileItFailedDoNotComeBack) {
  options_.max_handles = 4;
  restart();
  const auto session = create(mesh_);
  ASSERT_TRUE(keeps(session, ends_message(mesh_.vertices, 1, 1)));
  v1::Update added;
  added.set_input_seq(2);
  set_handle(added, "old", vertices_at(mesh_.vertices, 5), 0);
  ASSERT_TRUE(keeps(session, added));
  faults_->set_failing(true);
  for (std::uint64_t seq = 3; seq < 40; ++seq) {  // so many that the oldest are not remembered any more
    v1::Update removal;
    removal.set_input_seq(seq);
    removal.add_handles()->set_name(seq == 3 ? "old" : "none" + std::to_string(seq));
    removal.mutable_handles(0)->mutable_remove();
    take(session, removal);
  }
  faults_->set_failing(false);
  until_kept(session, 40);
  const std::string before = seen(session);
  EXPECT_EQ(before.find("\"old\""), std::string::npos);
  restart();
  EXPECT_EQ(seen(session), before);
}

TEST_F(StoreFaultsTest, WhileItFailsANewSessionIsRefusedAndLeavesNothing) {
  faults_->set_failing(true);
  v1::CreateSessionResponse session;
  const ErrorDetails details = details_of(try_create(request(), session));
  EXPECT_EQ(details.info.reason(), "STORE_FAILING");
  EXPECT_TRUE(details.retry.has_value());
  faults_->set_failing(false);
  EXPECT_TRUE(again_and_again([&] { return try_create(request(), session); }).ok());
}

TEST_F(StoreFaultsTest, WhileItFailsASessionThatOnlyItHasIsAskedForAgainLater) {
  const auto session = create(mesh_);
  restart();
  faults_->set_failing(true);
  v1::Session found;
  EXPECT_EQ(details_of(get(session.session().name(), found)).info.reason(), "STORE_FAILING");
  faults_->set_failing(false);
  EXPECT_TRUE(again_and_again([&] { return get(session.session().name(), found); }).ok());
}

TEST_F(StoreFaultsTest, WhileItFailsANewWriterAndADeletionAreNotConfirmed) {
  const auto session = create(mesh_);
  faults_->set_failing(true);
  v1::AcquireWriterRequest acquire;
  acquire.set_session(session.session().name());
  v1::AcquireWriterResponse lease;
  grpc::ClientContext acquiring, deleting;
  EXPECT_EQ(details_of(stub_->AcquireWriter(&acquiring, acquire, &lease)).info.reason(), "STORE_FAILING");
  v1::DeleteSessionRequest remove;
  remove.set_session(session.session().name());
  v1::DeleteSessionResponse removed;
  EXPECT_EQ(details_of(stub_->DeleteSession(&deleting, remove, &removed)).info.reason(), "STORE_FAILING");
  faults_->set_failing(false);
  const grpc::Status deleted = again_and_again([&] {
    grpc::ClientContext again;
    return stub_->DeleteSession(&again, remove, &removed);
  });
  EXPECT_TRUE(deleted.ok());
  restart();
  v1::Session found;
  EXPECT_EQ(details_of(get(session.session().name(), found)).info.reason(), "SESSION_UNKNOWN");
}

TEST_F(StoreFaultsTest, WhileItIsKnownToFailTheWriterStaysTheWriter) {
  const auto session = create(mesh_);
  faults_->set_failing(true);
  EXPECT_FALSE(take(session, ends_message(mesh_.vertices, 1, 1)).kept());
  v1::AcquireWriterRequest acquire;
  acquire.set_session(session.session().name());
  v1::AcquireWriterResponse lease;
  grpc::ClientContext context;
  EXPECT_EQ(details_of(stub_->AcquireWriter(&context, acquire, &lease)).info.reason(), "STORE_FAILING");
  EXPECT_TRUE(update(session, tip_message(2, 0.1)).ok());
}

TEST_F(StoreFaultsTest, AnEpochThatTheStoreNeverHeardOfIsNotBegunAgainByTheNextServer) {
  const auto session = create(mesh_);
  faults_->set_failing(true);  // which shows with the first that it does not take
  v1::AcquireWriterRequest acquire;
  acquire.set_session(session.session().name());
  v1::AcquireWriterResponse lease;
  grpc::ClientContext context;
  EXPECT_EQ(details_of(stub_->AcquireWriter(&context, acquire, &lease)).info.reason(), "STORE_FAILING");
  v1::Session before, after;
  ASSERT_TRUE(get(session.session().name(), before).ok());
  EXPECT_GT(before.epoch(), session.session().epoch());  // its frames have been seen
  restart();
  ASSERT_TRUE(get(session.session().name(), after).ok());
  EXPECT_GT(after.epoch(), before.epoch());
}

TEST_F(StoreFaultsTest, WhileItHangsUpdatesAreAnsweredSoonAndKeptLater) {
  const auto session = create(mesh_);
  ASSERT_TRUE(keeps(session, ends_message(mesh_.vertices, 1, 1)));
  faults_->set_hanging(true);
  DeformClient stream(*stub_, session);
  ASSERT_TRUE(stream.send(tip_message(2, 2)));
  ASSERT_TRUE(stream.settle(2).has_value());
  EXPECT_FALSE(take(session, tip_message(3, 2.5)).kept());
  faults_->set_hanging(false);
  until_kept(session, 4);
  const std::string before = seen(session);
  restart();
  EXPECT_EQ(seen(session), before);
}

TEST_F(StoreFaultsTest, AServerThatIsStoppedWhileItFailsWaitsForItAndThenSaysSo) {
  constexpr std::chrono::seconds kPromised{5};
  const auto session = create(mesh_);
  ASSERT_TRUE(keeps(session, ends_message(mesh_.vertices, 1, 1)));
  faults_->set_failing(true);
  for (std::uint64_t seq = 2; seq < 102; ++seq)
    EXPECT_FALSE(take(session, tip_message(seq, 0.01 * static_cast<double>(seq))).kept());
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_FALSE(server_->drain(std::chrono::milliseconds(0)));
  EXPECT_GE(std::chrono::steady_clock::now() - begin, kPromised);
  EXPECT_FALSE(server_->drain(std::chrono::milliseconds(0)));  // again: the same
}

TEST_F(StoreFaultsTest, ADeletionThatIsOpenWhileItHangsDoesNotKeepTheServerFromItsEnd) {
  const auto session = create(mesh_);
  faults_->set_hanging(true);
  grpc::Status deleted;
  std::thread deleting([&] {
    v1::DeleteSessionRequest request;
    request.set_session(session.session().name());
    v1::DeleteSessionResponse response;
    grpc::ClientContext context;
    deleted = stub_->DeleteSession(&context, request, &response);
  });
  v1::Session found;
  const auto end = std::chrono::steady_clock::now() + kTestDeadline;
  bool is_open = false;
  while (!is_open && std::chrono::steady_clock::now() < end)
    is_open = get(session.session().name(), found).error_code() == grpc::StatusCode::NOT_FOUND;
  EXPECT_TRUE(is_open);
  auto drained =
      std::async(std::launch::async, [&] { return server_->drain(std::chrono::milliseconds(200)); });
  EXPECT_EQ(drained.wait_for(kTestDeadline), std::future_status::ready);  // it hangs still
  faults_->set_hanging(false);
  EXPECT_FALSE(drained.get());
  deleting.join();
  EXPECT_EQ(deleted.error_code(), grpc::StatusCode::UNAVAILABLE) << deleted.error_message();
}

TEST_F(StoreFaultsTest, OneThatWorksAgainInTimeTakesAll) {
  const auto session = create(mesh_);
  ASSERT_TRUE(keeps(session, ends_message(mesh_.vertices, 1, 1)));
  const std::string before = seen(session);
  faults_->set_failing(true);
  EXPECT_FALSE(take(session, tip_message(2, 0.5)).kept());
  const std::string after = seen(session);
  EXPECT_NE(before, after);
  std::thread mending([this] {
    std::this_thread::sleep_for(std::chrono::milliseconds(500));  // while the server waits
    faults_->set_failing(false);
  });
  EXPECT_TRUE(server_->drain(std::chrono::milliseconds(0)));
  mending.join();
  restart();
  EXPECT_EQ(seen(session), after);
}

TEST_F(StoreFaultsTest, ASessionWhoseMeshIsDamagedIsToBeRecreated) {
  const auto session = create(mesh_);
  const auto other = create(box_surface(2, 2, 4));
  server_.reset();
  for (const auto& file : std::filesystem::directory_iterator(folder_ + "/blobs")) {
    if (file.file_size() == packed(mesh_.vertices).size() + packed(mesh_.faces).size())
      std::filesystem::resize_file(file.path(), 100);
  }
  restart();
  v1::Session found;
  const grpc::Status damaged = get(session.session().name(), found);
  EXPECT_EQ(damaged.error_code(), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(details_of(damaged).info.reason(), "SESSION_DAMAGED");
  EXPECT_TRUE(get(other.session().name(), found).ok());
}

/// The same with a Redis, whose disk is not always what it was.
class RedisFaultsTest : public StoreFaultsTest {
 protected:
  void SetUp() override { begin(); }
  /// Another server with the same Redis.
  void begin() {
    server_.reset();
    options_.store.reset();
    auto store = open_redis_store({.host = "127.0.0.1", .port = redis_.port()});
    ASSERT_TRUE(store.ok()) << store.status();
    options_.store = *std::move(store);
    start();
  }

  ~RedisFaultsTest() override {
    server_.reset();  // while there is a Redis
    options_.store.reset();
  }

  RedisServer redis_{folder_};
};

TEST_F(RedisFaultsTest, OneThatWentBackGetsLiveSessionsInWhole) {
  const auto session = create(mesh_), idle = create(mesh_);
  ASSERT_TRUE(keeps(session, ends_message(mesh_.vertices, 1, 1)));
  ASSERT_TRUE(keeps(idle, ends_message(mesh_.vertices, 1, 1)));
  const std::string saved = folder_ + "/saved";
  redis_.save_as(saved);
  ASSERT_TRUE(keeps(session, tip_message(2, 2)));
  ASSERT_TRUE(keeps(idle, tip_message(2, 2)));
  redis_.stop();
  redis_.go_back_to(saved);  // as one may be that was set to write each second only
  redis_.start();
  v1::Update other;
  other.set_input_seq(3);
  set_handle(other, "other", vertices_at(mesh_.vertices, 7), 0.5);
  while (!take(session, other).kept()) other.set_input_seq(other.input_seq() + 1);
  const std::string before = seen(session), before_idle = seen(idle), positions = solved(session);
  RedisConnection redis("127.0.0.1", redis_.port(), std::chrono::seconds(5));
  const std::string key = "lpdeform:s:" + idle.session().name();
  const auto end = std::chrono::steady_clock::now() + kTestDeadline;
  stored::Inputs inputs;
  do {  // nothing tells when it is written again
    const auto reply = redis.run({"HGET", key, "p:inputs"});
    ASSERT_TRUE(reply.ok() && inputs.ParseFromString(reply->text));
  } while (inputs.input_seq() < 2 && std::chrono::steady_clock::now() < end);
  begin();
  EXPECT_EQ(seen(session), before);
  EXPECT_EQ(seen(idle), before_idle);
  EXPECT_TRUE(solved(session) == positions);
}

TEST_F(RedisFaultsTest, OneThatIsAwayForLongerThanSessionsLiveUnusedLosesNone) {
  constexpr std::chrono::milliseconds kIdle{5000};  // Redis starts in less
  options_.session_idle = kIdle;
  begin();
  const auto session = create(mesh_);
  ASSERT_TRUE(keeps(session, everything(mesh_)));
  DeformClient stream(*stub_, session);  // so it is in use
  ASSERT_TRUE(stream.settle(7).has_value());
  redis_.stop();
  const auto end = std::chrono::steady_clock::now() + kIdle + kIdle / 2;
  std::uint64_t seq = 7;
  bool was_kept = false;
  while (std::chrono::steady_clock::now() < end) {
    ++seq;
    was_kept = take(session, tip_message(seq, 0.01 * static_cast<double>(seq))).kept();
  }
  EXPECT_FALSE(was_kept);
  redis_.start();
  until_kept(session, seq + 1);
  const std::string before = seen(session);
  begin();
  EXPECT_EQ(seen(session), before);
}

TEST_F(RedisFaultsTest, OneThatCameBackEmptyGetsLiveSessionsAgain) {
  const auto left = create(mesh_);
  begin();
  const auto session = create(mesh_);
  ASSERT_TRUE(keeps(session, everything(mesh_)));
  DeformClient stream(*stub_, session);
  ASSERT_TRUE(stream.settle(7).has_value());
  redis_.stop();
  redis_.lose_all();
  redis_.start();
  const std::uint64_t newest = until_kept(session, 8);
  ASSERT_TRUE(stream.settle(newest).has_value());  // it has not ended
  const std::string before = seen(session), positions = solved(session);
  begin();
  EXPECT_EQ(seen(session), before);
  EXPECT_TRUE(solved(session) == positions);
  v1::Session found;
  EXPECT_EQ(details_of(get(left.session().name(), found)).info.reason(), "SESSION_UNKNOWN");
}

TEST_F(RedisFaultsTest, OneThatHangsDoesNotKeepTheServerFromItsEnd) {
  constexpr std::chrono::seconds kGrace{1},
      kEnd{20};  // it takes 6 s at most, and would take 2 s for each session
  for (int k = 0; k < 20; ++k) create(mesh_);
  redis_.pause();
  const auto begin = std::chrono::steady_clock::now();
  server_->drain(kGrace);
  server_.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kEnd);
  redis_.resume();
}

}  // namespace
}  // namespace lpdeform
