// Callers that are identified by their tokens: who owns what, and who may do what.

#include <unistd.h>

#include <ctime>
#include <filesystem>
#include <fstream>
#include <thread>

#include "core/base/crc32c.h"
#include "server/keeping/snapshot.h"
#include "server/keeping/stored.pb.h"
#include "service_fixture.h"
#include "token_maker.h"

namespace lpdeform {
namespace {

class CallersTest : public ServiceTest {
 protected:
  CallersTest()
      : file_(std::filesystem::temp_directory_path() / ("lpdeform-callers-" + std::to_string(getpid()))) {
    std::ofstream(file_) << maker_.public_key();
    options_.token_keys_file = file_;
    options_.max_sessions_per_caller = 2;
  }
  ~CallersTest() override { std::filesystem::remove(file_); }

  /// The reason of a call's refusal; empty where it is none.
  template <typename Request, typename Response>
  std::string call(const std::string& token,
                   grpc::Status (v1::DeformService::Stub::*method)(grpc::ClientContext*, const Request&,
                                                                   Response*),
                   const Request& request, Response& response) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kTestDeadline);
    if (!token.empty()) context.AddMetadata("authorization", "Bearer " + token);
    const grpc::Status status = ((*stub_).*method)(&context, request, &response);
    return status.ok() ? "" : details_of(status).info.reason();
  }

  v1::CreateSessionResponse create_as(const std::string& token, const std::string& request_id = "") {
    v1::CreateSessionRequest request;
    request.set_request_id(request_id);
    *request.mutable_mesh() = mesh_message(bar_mesh());
    v1::CreateSessionResponse response;
    refusal_ = call(token, &Stub::CreateSession, request, response);
    return response;
  }

  std::size_t sessions_of(const std::string& token) {
    v1::ListSessionsResponse response;
    EXPECT_EQ(call(token, &Stub::ListSessions, v1::ListSessionsRequest(), response), "");
    return static_cast<std::size_t>(response.sessions_size());
  }

  /// What each call about somebody's session answers.
  std::map<std::string, std::string> refusals(const std::string& token,
                                              const v1::CreateSessionResponse& session) {
    const std::string& name = session.session().name();
    std::map<std::string, std::string> all;
    v1::GetSessionRequest get;
    get.set_session(name);
    v1::GetSessionResponse got;
    all["get"] = call(token, &Stub::GetSession, get, got);
    v1::AcquireWriterRequest acquire;
    acquire.set_session(name);
    v1::AcquireWriterResponse acquired;
    all["acquire"] = call(token, &Stub::AcquireWriter, acquire, acquired);
    v1::UpdateHandlesRequest update;
    update.set_session(name);
    update.set_writer_token(session.writer_token());
    *update.mutable_update() = ends_message(bar_mesh().vertices, 1, 0.5);
    v1::UpdateHandlesResponse updated;
    all["update"] = call(token, &Stub::UpdateHandles, update, updated);
    v1::AckFramesRequest ack;
    ack.set_session(name);
    ack.set_stream_id("none");
    v1::AckFramesResponse acked;
    all["ack"] = call(token, &Stub::AckFrames, ack, acked);
    v1::SolveRequest solve;
    solve.set_session(name);
    solve.set_writer_token(session.writer_token());
    grpc::ClientContext solving;
    if (!token.empty()) solving.AddMetadata("authorization", "Bearer " + token);
    const SolveOutcome outcome = ServiceTest::solve(solve, &solving);
    all["solve"] = outcome.status.ok() ? "" : details_of(outcome.status).info.reason();
    v1::StreamFramesRequest frames;
    frames.set_session(name);
    grpc::ClientContext streaming;
    if (!token.empty()) streaming.AddMetadata("authorization", "Bearer " + token);
    const auto reader = stub_->StreamFrames(&streaming, frames);
    v1::StreamFramesResponse frame;
    const bool has_frames = reader->Read(&frame);
    if (has_frames) streaming.TryCancel();
    const grpc::Status ended = reader->Finish();
    all["frames"] = has_frames ? "" : details_of(ended).info.reason();
    v1::SnapshotSessionRequest snapshot;
    snapshot.set_session(name);
    grpc::ClientContext saving;
    if (!token.empty()) saving.AddMetadata("authorization", "Bearer " + token);
    const auto parts = stub_->SnapshotSession(&saving, snapshot);
    v1::SnapshotSessionResponse part;
    while (parts->Read(&part)) file_of_it_ += part.data();
    const grpc::Status saved = parts->Finish();
    all["snapshot"] = saved.ok() ? "" : details_of(saved).info.reason();
    v1::UndoUpdateRequest undo;
    undo.set_session(name);
    undo.set_writer_token(session.writer_token());
    undo.set_input_seq(100);
    v1::UndoUpdateResponse undone;
    all["undo"] = call(token, &Stub::UndoUpdate, undo, undone);
    v1::TakeBetterShapeRequest take;
    take.set_session(name);
    take.set_writer_token(session.writer_token());
    v1::TakeBetterShapeResponse taken;
    all["take"] = call(token, &Stub::TakeBetterShape, take, taken);
    return all;
  }

  using Stub = v1::DeformService::Stub;
  const std::filesystem::path file_;
  const TokenMaker maker_;
  const std::string alice_ = maker_.token_of("alice"), bob_ = maker_.token_of("bob"),
                    viewer_ = maker_.token_of("alice", "viewer");
  std::string refusal_, file_of_it_;
};

TEST_F(CallersTest, WithoutATokenNothingIsAnswered) {
  const auto session = create_as(alice_);
  for (const auto& [name, reason] : refusals("", session)) EXPECT_EQ(reason, "TOKEN_MISSING") << name;
  for (const auto& [name, reason] : refusals("nonsense", session)) EXPECT_EQ(reason, "TOKEN_INVALID") << name;
  create_as("");
  EXPECT_EQ(refusal_, "TOKEN_MISSING");
  v1::CreateUploadRequest upload;
  v1::CreateUploadResponse uploaded;
  EXPECT_EQ(call("", &Stub::CreateUpload, upload, uploaded), "TOKEN_MISSING");
}

TEST_F(CallersTest, SomebodyElsesSessionIsNotThere) {
  const auto session = create_as(alice_);
  for (const auto& [name, reason] : refusals(bob_, session)) EXPECT_EQ(reason, "SESSION_UNKNOWN") << name;
  v1::DeleteSessionRequest remove;
  remove.set_session(session.session().name());
  v1::DeleteSessionResponse removed;
  EXPECT_EQ(call(bob_, &Stub::DeleteSession, remove, removed), "");  // as where there is none
  EXPECT_EQ(sessions_of(alice_), 1u);
  EXPECT_EQ(sessions_of(bob_), 0u);
  EXPECT_EQ(call(alice_, &Stub::DeleteSession, remove, removed), "");
  EXPECT_EQ(sessions_of(alice_), 0u);
}

TEST_F(CallersTest, AViewerSeesTheSubjectsSessionsAndChangesNothing) {
  const auto session = create_as(alice_);
  const auto reasons = refusals(viewer_, session);
  for (const char* const change : {"acquire", "update", "solve", "snapshot", "undo", "take"})
    EXPECT_EQ(reasons.at(change), "READ_ONLY") << change;
  for (const char* const look : {"get", "frames"}) EXPECT_EQ(reasons.at(look), "") << look;
  EXPECT_EQ(reasons.at("ack"), "STREAM_UNKNOWN");
  EXPECT_EQ(sessions_of(viewer_), 1u);
  create_as(viewer_);
  EXPECT_EQ(refusal_, "READ_ONLY");
  v1::DeleteSessionRequest remove;
  remove.set_session(session.session().name());
  v1::DeleteSessionResponse removed;
  EXPECT_EQ(call(viewer_, &Stub::DeleteSession, remove, removed), "READ_ONLY");
  EXPECT_EQ(sessions_of(alice_), 1u);
}

TEST_F(CallersTest, ARestoredSessionIsItsCallersAndCountsAsOne) {
  const auto session = create_as(alice_);
  refusals(alice_, session);
  v1::RestoreSessionRequest restore;
  restore.mutable_snapshot()->set_inline_(file_of_it_);
  v1::RestoreSessionResponse restored;
  EXPECT_EQ(call(viewer_, &Stub::RestoreSession, restore, restored), "READ_ONLY");
  EXPECT_EQ(call("", &Stub::RestoreSession, restore, restored), "TOKEN_MISSING");
  EXPECT_EQ(call(alice_, &Stub::RestoreSession, restore, restored), "");
  EXPECT_EQ(call(alice_, &Stub::RestoreSession, restore, restored), "CALLER_SESSIONS_FULL");
  EXPECT_EQ(call(bob_, &Stub::RestoreSession, restore, restored), "");
  EXPECT_EQ(sessions_of(alice_), 2u);
  EXPECT_EQ(sessions_of(bob_), 1u);
}

TEST_F(CallersTest, OneCallerCannotTakeAllSessions) {
  create_as(alice_);
  const auto second = create_as(alice_);
  create_as(alice_);
  EXPECT_EQ(refusal_, "CALLER_SESSIONS_FULL");
  create_as(bob_);
  EXPECT_EQ(refusal_, "");
  v1::DeleteSessionRequest remove;
  remove.set_session(second.session().name());
  v1::DeleteSessionResponse removed;
  EXPECT_EQ(call(alice_, &Stub::DeleteSession, remove, removed), "");
  v1::CreateSessionRequest bad;  // a failure takes no place
  v1::CreateSessionResponse none;
  for (int k = 0; k < 3; ++k) EXPECT_NE(call(alice_, &Stub::CreateSession, bad, none), "");
  create_as(alice_);
  EXPECT_EQ(refusal_, "");
}

class CallersWithLimitsTest : public CallersTest {
 protected:
  CallersWithLimitsTest() {
    timers_ = std::make_shared<ManualTimers>();
    options_.max_streams_per_caller = 1;
    options_.max_bytes_per_caller.bytes = std::size_t{5}
                                          << 19;  // two small sessions by the estimate, not three
    options_.max_upload_bytes_per_second = 1 << 20;
    options_.max_sessions_per_caller = 0;
  }

  struct Reader {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReader<v1::StreamFramesResponse>> stream;
  };
  /// A stream of frames; empty where it is refused, with the reason in refusal_.
  std::unique_ptr<Reader> look(const std::string& token, const v1::CreateSessionResponse& session) {
    auto reader = std::make_unique<Reader>();
    reader->context.AddMetadata("authorization", "Bearer " + token);
    v1::StreamFramesRequest request;
    request.set_session(session.session().name());
    reader->stream = stub_->StreamFrames(&reader->context, request);
    v1::StreamFramesResponse first;
    if (reader->stream->Read(&first)) return reader;
    refusal_ = details_of(reader->stream->Finish()).info.reason();
    return nullptr;
  }
};

TEST_F(CallersWithLimitsTest, OneCallerCannotTakeAllStreams) {
  const auto of_alice = create_as(alice_), of_bob = create_as(bob_);
  auto first = look(alice_, of_alice);
  ASSERT_TRUE(first);
  EXPECT_FALSE(look(alice_, of_alice));
  EXPECT_EQ(refusal_, "CALLER_STREAMS_FULL");
  EXPECT_FALSE(look(viewer_, of_alice));
  const auto other = look(bob_, of_bob);
  EXPECT_TRUE(other);
  first->context.TryCancel();
  const auto end = std::chrono::steady_clock::now() + kTestDeadline;
  std::unique_ptr<Reader> again;
  while (!(again = look(alice_, of_alice)) && std::chrono::steady_clock::now() < end)
    std::this_thread::yield();
  EXPECT_TRUE(again);
  for (auto* const reader : {again.get(), other.get()}) reader->context.TryCancel();
}

TEST_F(CallersWithLimitsTest, OneCallerCannotTakeAllMemory) {
  const auto first = create_as(alice_), second = create_as(alice_);
  EXPECT_EQ(refusal_, "");
  create_as(alice_);
  EXPECT_EQ(refusal_, "CALLER_MEMORY_FULL");
  create_as(bob_);
  EXPECT_EQ(refusal_, "");
  v1::DeleteSessionRequest remove;
  remove.set_session(second.session().name());
  v1::DeleteSessionResponse removed;
  EXPECT_EQ(call(alice_, &Stub::DeleteSession, remove, removed), "");
  const auto end =
      std::chrono::steady_clock::now() + kTestDeadline;  // it goes when the last thread releases it
  do create_as(alice_);
  while (refusal_ == "CALLER_MEMORY_FULL" && std::chrono::steady_clock::now() < end);
  EXPECT_EQ(refusal_, "");
}

TEST_F(CallersWithLimitsTest, SnapshotsCountAsMemoryOfTheirCaller) {
  const auto session = create_as(alice_);
  refusals(alice_, session);
  const std::string file = file_of_it_;
  create_as(alice_);  // now there is no room for more
  ASSERT_EQ(refusal_, "");
  stored::Snapshot snapshot;
  ASSERT_TRUE(snapshot.ParseFromString(file.substr(kSnapshotHeaderBytes)));
  (*snapshot.mutable_parts())["unread"] = std::string(700'000, 'x');
  const std::string content = snapshot.SerializeAsString();
  v1::RestoreSessionRequest restore;
  restore.mutable_snapshot()->set_inline_(snapshot_header(content) + content);
  v1::RestoreSessionResponse restored;
  EXPECT_EQ(call(alice_, &Stub::RestoreSession, restore, restored), "CALLER_MEMORY_FULL");
  EXPECT_EQ(call(bob_, &Stub::RestoreSession, restore, restored), "");
}

TEST_F(CallersWithLimitsTest, UploadsThatComeTooFastAreToldWhenToComeAgain) {
  v1::CreateUploadRequest create;
  create.set_size_bytes(2 << 20);
  v1::CreateUploadResponse created;
  ASSERT_EQ(call(alice_, &Stub::CreateUpload, create, created), "");
  v1::UploadPartRequest part;
  part.set_upload(created.upload());
  part.set_data(std::string(1 << 20, 'x'));
  v1::UploadPartResponse progress;
  for (int k = 0; k < 4; ++k) ASSERT_EQ(call(alice_, &Stub::UploadPart, part, progress), "") << k;
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer " + alice_);
  const ErrorDetails details = details_of(stub_->UploadPart(&context, part, &progress));
  EXPECT_EQ(details.info.reason(), "UPLOAD_RATE");
  ASSERT_TRUE(details.retry && details.quota);
  EXPECT_EQ(details.retry->retry_delay().seconds(), 1);
  timers_->advance(std::chrono::seconds(1));
  EXPECT_EQ(call(alice_, &Stub::UploadPart, part, progress), "");
}

TEST_F(CallersTest, RequestIdsOfDifferentCallersAreDifferent) {
  const auto first = create_as(alice_, "request-1");
  EXPECT_EQ(create_as(alice_, "request-1").session().name(), first.session().name());
  EXPECT_NE(create_as(bob_, "request-1").session().name(), first.session().name());
}

TEST_F(CallersTest, SomebodyElsesUploadIsNotThere) {
  const TriangleMesh mesh = bar_mesh();
  const std::string bytes = packed(mesh.vertices) + packed(mesh.faces);
  v1::CreateUploadRequest create;
  create.set_size_bytes(bytes.size());
  create.set_crc32c(crc32c(bytes));
  v1::CreateUploadResponse created;
  ASSERT_EQ(call(alice_, &Stub::CreateUpload, create, created), "");
  v1::UploadPartRequest part;
  part.set_upload(created.upload());
  part.set_data(bytes);
  v1::UploadPartResponse progress;
  EXPECT_EQ(call(bob_, &Stub::UploadPart, part, progress), "UPLOAD_UNKNOWN");
  ASSERT_EQ(call(alice_, &Stub::UploadPart, part, progress), "");
  v1::DeleteUploadRequest remove;
  remove.set_upload(created.upload());
  v1::DeleteUploadResponse removed;
  EXPECT_EQ(call(bob_, &Stub::DeleteUpload, remove, removed), "");  // as where there is none
  v1::CreateSessionRequest use;
  *use.mutable_mesh() = mesh_message(mesh);
  use.mutable_mesh()->mutable_data()->set_upload(created.upload());
  v1::CreateSessionResponse session;
  EXPECT_EQ(call(bob_, &Stub::CreateSession, use, session), "UPLOAD_UNKNOWN");
  EXPECT_EQ(call(alice_, &Stub::CreateSession, use, session), "");
}

TEST_F(CallersTest, AStreamEndsWhenItsTokenHasExpired) {
  server_.reset();
  timers_ = std::make_shared<ManualTimers>();
  start();
  const auto session = create_as(alice_);
  const std::string soon =
      maker_.sign("{\"sub\": \"alice\", \"exp\": " + std::to_string(std::time(nullptr) + 300) + "}");
  const auto open = [&](grpc::ClientContext& context, const std::string& token) {
    context.set_deadline(std::chrono::system_clock::now() + kTestDeadline);
    context.AddMetadata("authorization", "Bearer " + token);
    v1::StreamFramesRequest request;
    request.set_session(session.session().name());
    auto reader = stub_->StreamFrames(&context, request);
    v1::StreamFramesResponse response;
    EXPECT_TRUE(reader->Read(&response) && response.event().has_opened());
    return reader;
  };
  grpc::ClientContext short_context, long_context;
  const auto short_stream = open(short_context, soon), long_stream = open(long_context, alice_);
  timers_->advance(std::chrono::seconds(250));
  timers_->advance(std::chrono::seconds(100));  // with the difference between clocks that is forgiven
  v1::StreamFramesResponse response;
  while (short_stream->Read(&response) && !response.event().has_go_away()) {
  }
  EXPECT_EQ(response.event().go_away().reason(), v1::GO_AWAY_REASON_TOKEN_EXPIRED);
  EXPECT_TRUE(short_stream->Finish().ok());
  EXPECT_TRUE(long_stream->Read(&response));
  EXPECT_FALSE(response.event().has_go_away());
  long_context.TryCancel();
}

TEST_F(CallersTest, AStreamWhoseTokenIsGoodForAgesGoesOn) {
  const auto session = create_as(alice_);
  for (const char* const expires :
       {"1795000000000", "900000000000000"}) {  // the first is a date in milliseconds
    const std::string token = maker_.sign(std::string("{\"sub\": \"alice\", \"exp\": ") + expires + "}");
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kTestDeadline);
    context.AddMetadata("authorization", "Bearer " + token);
    v1::StreamFramesRequest request;
    request.set_session(session.session().name());
    const auto reader = stub_->StreamFrames(&context, request);
    v1::StreamFramesResponse response;
    ASSERT_TRUE(reader->Read(&response) && response.event().has_opened());
    ASSERT_TRUE(reader->Read(&response));
    EXPECT_TRUE(response.event().has_frame()) << response.ShortDebugString();
    context.TryCancel();
    (void)reader->Finish();
  }
}

TEST_F(CallersTest, AStreamThatWasLetInGoesOn) {
  const auto session = create_as(alice_);
  grpc::ClientContext context;
  context.AddMetadata("authorization", "Bearer " + alice_);
  const auto stream = stub_->Deform(&context);
  v1::DeformRequest request;
  request.mutable_open()->set_session(session.session().name());
  request.mutable_open()->set_writer_token(session.writer_token());
  ASSERT_TRUE(stream->Write(request));
  *request.mutable_update() = ends_message(bar_mesh().vertices, 1, 0.5);
  ASSERT_TRUE(stream->Write(request));
  v1::DeformResponse response;
  while (stream->Read(&response) && !response.has_result()) ASSERT_FALSE(response.event().has_fault());
  EXPECT_EQ(response.result().input_seq(), 1u);
  context.TryCancel();
}

}  // namespace
}  // namespace lpdeform
