#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <string>

#include "faulty_store.h"
#include "server/sqlite_store.h"
#include "service_fixture.h"

namespace lpdeform {

/// A server with a store in a folder, and those that come after it.
class RestartTest : public ServiceTest {
 protected:
  RestartTest() {
    char name[] = "/tmp/lpdeform-restart-XXXXXX";
    folder_ = mkdtemp(name);
  }
  ~RestartTest() override {
    server_.reset();
    std::filesystem::remove_all(folder_);
  }
  void SetUp() override { restart(); }

  /// Another server with the same store.
  void restart() {
    server_.reset();
    options_.store.reset();
    faults_.reset();
    auto store = open_sqlite_store({folder_});
    ASSERT_TRUE(store.ok()) << store.status();
    options_.store = faults_ = std::make_shared<FaultyStore>(*std::move(store));
    start();
  }

  v1::UpdateResult take(const v1::CreateSessionResponse& session, const v1::Update& update) {
    v1::UpdateHandlesRequest request;
    request.set_session(session.session().name());
    request.set_writer_token(session.writer_token());
    *request.mutable_update() = update;
    v1::UpdateHandlesResponse response;
    grpc::ClientContext context;
    const grpc::Status status = stub_->UpdateHandles(&context, request, &response);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return response.result();
  }

  grpc::Status get(const std::string& name, v1::Session& session) {
    v1::GetSessionRequest request;
    request.set_session(name);
    v1::GetSessionResponse response;
    grpc::ClientContext context;
    const grpc::Status status = stub_->GetSession(&context, request, &response);
    session = response.session();
    return status;
  }

  /// All of a session that clients can see but what differs from one process to the next.
  std::string seen(const v1::CreateSessionResponse& session) {
    v1::Session found;
    EXPECT_TRUE(get(session.session().name(), found).ok());
    found.clear_epoch();
    found.clear_expires_unix_ms();
    found.clear_memory_bytes();
    return found.DebugString();
  }

  /// The solved positions.
  std::string solved(const v1::CreateSessionResponse& session) {
    v1::SolveRequest request = solve_request(session);
    request.set_scalar(v1::SCALAR_FLOAT64);
    const SolveOutcome outcome = solve(request);
    EXPECT_TRUE(outcome.status.ok()) << outcome.status.error_message();
    return outcome.frame ? outcome.frame->positions : "";
  }

  std::string folder_;
  std::shared_ptr<FaultyStore> faults_;
};

}  // namespace lpdeform
