// The unary calls of the running service, and the errors that they share.

#include <grpcpp/generic/generic_stub.h>

#include <functional>
#include <future>
#include <limits>
#include <map>
#include <thread>

#include "core/base/fault.h"
#include "server/admin/health_probe.h"
#include "service_fixture.h"

namespace lpdeform {
namespace {

class CallsTest : public ServiceTest {};

TEST_F(CallsTest, ASessionIsCreatedDescribedListedAndDeleted) {
  const auto created = create(bar_mesh());
  EXPECT_EQ(created.session().name().size(), std::string("sessions/").size() + 32);
  EXPECT_EQ(created.session().epoch(), 1u);
  EXPECT_EQ(created.session().mesh().vertices(), 370);
  EXPECT_EQ(created.session().mesh().faces(), 736);
  EXPECT_EQ(created.session().mesh().components(), 1);
  EXPECT_GT(created.session().mesh().defects_size(), 5);
  EXPECT_EQ(created.session().settings().p().uniform(), 2.0);
  EXPECT_GT(created.session().memory_bytes(), 370u * 24);
  EXPECT_GT(created.session().expires_unix_ms(), created.session().created_unix_ms());
  ASSERT_TRUE(update(created, ends_message(bar_mesh().vertices, 3, 1)).ok());

  v1::GetSessionRequest get;
  get.set_session(created.session().name());
  v1::GetSessionResponse got;
  grpc::ClientContext get_context, list_context;
  ASSERT_TRUE(stub_->GetSession(&get_context, get, &got).ok());
  EXPECT_EQ(got.session().input_seq(), 3u);
  ASSERT_EQ(got.session().handles_size(), 2);
  EXPECT_EQ(got.session().handles(1).name(), "tip");
  EXPECT_EQ(got.session().handles(1).vertex_count(), 25u);

  v1::ListSessionsResponse listed;
  ASSERT_TRUE(stub_->ListSessions(&list_context, {}, &listed).ok());
  ASSERT_EQ(listed.sessions_size(), 1);
  EXPECT_EQ(listed.sessions(0).name(), created.session().name());

  for (int times = 0; times < 2; ++times) {
    grpc::ClientContext context;
    v1::DeleteSessionRequest request;
    v1::DeleteSessionResponse response;
    request.set_session(created.session().name());
    EXPECT_TRUE(stub_->DeleteSession(&context, request, &response).ok());
  }
  grpc::ClientContext again;
  EXPECT_EQ(stub_->GetSession(&again, get, &got).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(CallsTest, TheSameRequestIdCreatesOneSessionAlsoAtTheSameTime) {
  v1::CreateSessionRequest request;
  request.set_request_id("request-1");
  *request.mutable_mesh() = mesh_message(bar_mesh());
  std::vector<v1::CreateSessionResponse> responses(4);
  std::vector<std::thread> callers;
  for (auto& response : responses) {
    callers.emplace_back([&] { EXPECT_TRUE(try_create(request, response).ok()); });
  }
  for (auto& caller : callers) caller.join();
  for (const auto& response : responses) {
    EXPECT_EQ(response.session().name(), responses[0].session().name());
    EXPECT_EQ(response.writer_token(), responses[0].writer_token());
  }
  v1::ListSessionsResponse listed;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->ListSessions(&context, {}, &listed).ok());
  EXPECT_EQ(listed.sessions_size(), 1);
}

TEST_F(CallsTest, ACompressedMessageIsRefusedAndSaysSo) {
  for (const auto algorithm : {GRPC_COMPRESS_GZIP, GRPC_COMPRESS_DEFLATE}) {
    v1::UploadPartRequest part;
    part.set_data(std::string(1 << 20, '\0'));
    v1::UploadPartResponse taken;
    grpc::ClientContext context, stream_context;
    context.set_compression_algorithm(algorithm);
    const grpc::Status refused = stub_->UploadPart(&context, part, &taken);
    EXPECT_EQ(refused.error_code(), grpc::StatusCode::UNIMPLEMENTED);
    EXPECT_NE(refused.error_message().find("ompression"), std::string::npos) << refused.error_message();

    stream_context.set_compression_algorithm(algorithm);
    const auto stream = stub_->Deform(&stream_context);
    v1::DeformRequest open;
    open.mutable_open()->set_session(std::string(1 << 20, 'a'));
    stream->Write(open);
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::UNIMPLEMENTED);
  }
}

TEST_F(CallsTest, AMessageThatCannotBeReadIsRefusedByReason) {
  grpc::GenericStub stub(grpc::CreateChannel(server_->address(), grpc::InsecureChannelCredentials()));
  grpc::ClientContext context;
  const grpc::Slice no_message("\xff\xff\xff");
  const grpc::ByteBuffer request(&no_message, 1);
  grpc::ByteBuffer response;
  std::promise<grpc::Status> ended;
  stub.UnaryCall(&context, "/lpdeform.v1.DeformService/UploadPart", {}, &request, &response,
                 [&ended](grpc::Status status) { ended.set_value(std::move(status)); });
  const grpc::Status status = ended.get_future().get();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(details_of(status).info.reason(), "MESSAGE_UNREADABLE");
}

TEST_F(CallsTest, ASessionMayBeginWithHandlesAndSettings) {
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(bar_mesh());
  request.set_weights(v1::WEIGHT_KIND_UNIFORM);
  request.set_free_components(v1::FREE_COMPONENTS_STAY);
  *request.mutable_handles() = ends_message(bar_mesh().vertices, 0, 2).handles();
  request.mutable_settings()->mutable_p()->set_uniform(1.5);
  v1::CreateSessionResponse created;
  ASSERT_TRUE(try_create(request, created).ok());
  EXPECT_EQ(created.session().weights(), v1::WEIGHT_KIND_UNIFORM);
  EXPECT_EQ(created.session().free_components(), v1::FREE_COMPONENTS_STAY);
  EXPECT_EQ(created.session().handles_size(), 2);
  EXPECT_EQ(created.session().settings().p().uniform(), 1.5);
  const SolveOutcome outcome = solve(solve_request(created));
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.summary.stop_reason(), v1::STOP_REASON_CONVERGED);
  EXPECT_GT(outcome.summary.energy(), 0);
}

TEST_F(CallsTest, IntrinsicWeightsClampNothingAndTellWhatTheyFlipped) {
  TriangleMesh mesh = bar_mesh();
  mesh.vertices.col(0) *= 0.1;
  mesh.vertices.col(2) += 2 * mesh.vertices.col(1);
  std::map<v1::WeightKind, std::map<std::string, std::uint32_t>> counts;
  for (const v1::WeightKind kind : {v1::WEIGHT_KIND_COTANGENT, v1::WEIGHT_KIND_INTRINSIC_DELAUNAY}) {
    v1::CreateSessionRequest request;
    *request.mutable_mesh() = mesh_message(mesh);
    request.set_weights(kind);
    v1::CreateSessionResponse created;
    ASSERT_TRUE(try_create(request, created).ok());
    EXPECT_EQ(created.session().weights(), kind);
    for (const v1::Defect& defect : created.session().mesh().defects())
      counts[kind][defect.kind()] = defect.count();
  }
  EXPECT_GT(counts[v1::WEIGHT_KIND_COTANGENT]["clamped_edges"], 0);
  EXPECT_EQ(counts[v1::WEIGHT_KIND_COTANGENT]["flipped_edges"], 0);
  EXPECT_EQ(counts[v1::WEIGHT_KIND_INTRINSIC_DELAUNAY]["clamped_edges"], 0);
  EXPECT_GT(counts[v1::WEIGHT_KIND_INTRINSIC_DELAUNAY]["flipped_edges"], 0);
}

TEST_F(CallsTest, EveryCallSaysNotFoundForASessionThatIsNot) {
  v1::CreateSessionResponse nobody;
  nobody.mutable_session()->set_name("sessions/00000000000000000000000000000000");
  nobody.set_writer_token("token");
  std::vector<grpc::Status> statuses = {update(nobody, tip_message(1, 1)),
                                        solve(solve_request(nobody)).status};
  {
    grpc::ClientContext context;
    v1::GetSessionRequest request;
    v1::GetSessionResponse response;
    statuses.push_back(stub_->GetSession(&context, request, &response));
  }
  {
    grpc::ClientContext context;
    v1::AcquireWriterRequest request;
    v1::AcquireWriterResponse response;
    statuses.push_back(stub_->AcquireWriter(&context, request, &response));
  }
  {
    grpc::ClientContext context;
    v1::AckFramesRequest request;
    v1::AckFramesResponse response;
    statuses.push_back(stub_->AckFrames(&context, request, &response));
  }
  {
    grpc::ClientContext context;
    v1::StreamFramesResponse response;
    const auto stream = stub_->StreamFrames(&context, {});
    EXPECT_FALSE(stream->Read(&response));
    statuses.push_back(stream->Finish());
  }
  DeformClient deform(*stub_, nobody);
  statuses.push_back(deform.read_to_end());
  for (const grpc::Status& status : statuses) {
    EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND);
    const ErrorDetails details = details_of(status);
    EXPECT_EQ(details.info.reason(), "SESSION_UNKNOWN");
    ASSERT_TRUE(details.resource.has_value());
    EXPECT_EQ(details.resource->resource_type(), "lpdeform.v1.Session");
    EXPECT_FALSE(details.retry.has_value());
  }
}

TEST_F(CallsTest, ChangingASessionNeedsItsToken) {
  auto session = create(bar_mesh());
  const std::string token = session.writer_token();
  session.set_writer_token("");
  EXPECT_EQ(update(session, tip_message(1, 1)).error_code(), grpc::StatusCode::UNAUTHENTICATED);
  const SolveOutcome refused = solve(solve_request(session));
  EXPECT_EQ(refused.status.error_code(), grpc::StatusCode::UNAUTHENTICATED);
  EXPECT_EQ(details_of(refused.status).info.reason(), "WRITER_TOKEN_MISSING");
  session.set_writer_token(std::string(token.size(), '0'));
  const grpc::Status status = update(session, tip_message(1, 1));
  EXPECT_EQ(status.error_code(), grpc::StatusCode::PERMISSION_DENIED);
  EXPECT_EQ(details_of(status).info.reason(), "NOT_THE_WRITER");
  DeformClient deform(*stub_, session);
  EXPECT_EQ(deform.read_to_end().error_code(), grpc::StatusCode::PERMISSION_DENIED);
}

TEST_F(CallsTest, AnUpdateIsAnsweredWithItsStaleParts) {
  const auto session = create(bar_mesh());
  ASSERT_TRUE(update(session, ends_message(bar_mesh().vertices, 5, 1)).ok());
  v1::UpdateHandlesRequest request;
  request.set_session(session.session().name());
  request.set_writer_token(session.writer_token());
  *request.mutable_update() = tip_message(4, 3);
  v1::UpdateHandlesResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->UpdateHandles(&context, request, &response).ok());
  EXPECT_EQ(response.result().input_seq(), 4u);
  EXPECT_EQ(response.result().stale_parts(), 1u);
}

TEST_F(CallsTest, GetSessionSaysHowHandlesAreHeldAndHowMuchMayMove) {
  const auto session = create(bar_mesh());
  v1::Update held;
  held.set_input_seq(1);
  set_handle(held, "a", {0, 1, 2}, 0);
  held.mutable_handles(0)->mutable_set()->mutable_plane_lock()->mutable_normal()->set_x(1);
  v1::HandleUpdate& point = *held.add_handles();
  point.set_name("b");
  v1::SurfacePoints& points = *point.mutable_set()->mutable_points();
  points.mutable_faces()->set_inline_(std::string(4, '\0'));
  const float barycentric[] = {0.5F, 0.25F, 0.25F};
  points.mutable_barycentric()->set_inline_(
      std::string(reinterpret_cast<const char*>(barycentric), sizeof(barycentric)));
  point.mutable_set()->mutable_soft();
  held.mutable_settings()->mutable_region()->mutable_vertices()->set_inline_(std::string(8, '\0'));
  ASSERT_TRUE(update(session, held).ok());

  v1::GetSessionRequest get;
  get.set_session(session.session().name());
  v1::GetSessionResponse got;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->GetSession(&context, get, &got).ok());
  ASSERT_EQ(got.session().handles_size(), 2);
  EXPECT_EQ(got.session().handles(0).kind(), v1::HANDLE_KIND_PLANE_LOCK);
  EXPECT_EQ(got.session().handles(0).vertex_count(), 3u);
  EXPECT_EQ(got.session().handles(1).kind(), v1::HANDLE_KIND_SOFT);
  EXPECT_EQ(got.session().handles(1).point_count(), 1u);
  EXPECT_EQ(got.session().region_vertex_count(), 1u);  // vertex 0, given twice
}

TEST_F(CallsTest, AnUploadThatWasDamagedOnTheWayIsDataLoss) {
  v1::CreateUploadRequest announce;
  announce.set_size_bytes(4);
  announce.set_crc32c(1);
  v1::CreateUploadResponse created;
  grpc::ClientContext create_context, part_context, mesh_context;
  ASSERT_TRUE(stub_->CreateUpload(&create_context, announce, &created).ok());
  v1::UploadPartRequest part;
  part.set_upload(created.upload());
  part.set_data("abcd");
  v1::UploadPartResponse answer;
  const grpc::Status status = stub_->UploadPart(&part_context, part, &answer);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::DATA_LOSS);
  EXPECT_EQ(details_of(status).info.reason(), "UPLOAD_CHECKSUM");
}

/// A wrong session, made from the bar, and the reason that it is refused for.
TEST_F(CallsTest, MemoryIsEstimatedAtFirstAndKnownAfterASolve) {
  const auto session = create(sphere(4));
  const std::uint64_t estimate = session.session().memory_bytes();
  v1::SolveRequest request = solve_request(session);
  request.mutable_update()->set_input_seq(1);
  set_handle(*request.mutable_update(), "a", {0}, 0);
  set_handle(*request.mutable_update(), "b", {1}, 0.1);
  ASSERT_TRUE(solve(request).status.ok());
  v1::GetSessionRequest get;
  get.set_session(session.session().name());
  std::uint64_t known = estimate;  // until a moment after the answer
  const auto end = std::chrono::steady_clock::now() + kTestDeadline;
  while (known == estimate && std::chrono::steady_clock::now() < end) {
    v1::GetSessionResponse got;
    grpc::ClientContext context;
    ASSERT_TRUE(stub_->GetSession(&context, get, &got).ok());
    known = got.session().memory_bytes();
  }
  EXPECT_NE(known, estimate);
  EXPECT_GT(known, estimate / 3);
  EXPECT_LT(known, estimate);  // an estimate that is too low would let too many in
}

TEST_F(CallsTest, HealthSaysServingUntilTheServerDrains) {
  EXPECT_TRUE(is_serving(server_->address()));
  EXPECT_TRUE(is_serving(server_->address(), "lpdeform.v1.DeformService"));
  EXPECT_FALSE(is_serving(server_->address(), "lpdeform.v1.NoService"));
  const std::string address = server_->address();
  server_->drain(std::chrono::milliseconds(0));
  EXPECT_FALSE(is_serving(address));
}

TEST_F(CallsTest, ATakenPortIsAnError) {
  ServerOptions options;
  options.address = server_->address();
  const auto second = Server::start(options);
  EXPECT_TRUE(absl::IsUnavailable(second.status())) << second.status();
}

TEST(ServerOptionsTest, TheMemoryOfACallerIsAShareOfAll) {
  ServerOptions options;
  options.max_bytes = 1000;
  EXPECT_EQ(caller_max_bytes(options), 500u);
  options.max_bytes_per_caller.percent = 25;
  EXPECT_EQ(caller_max_bytes(options), 250u);
  options.max_bytes = 1;  // 0 would be without limit
  EXPECT_EQ(caller_max_bytes(options), 1u);
  options.max_bytes_per_caller.bytes = 7;
  EXPECT_EQ(caller_max_bytes(options), 7u);
  options.max_bytes_per_caller.bytes = 0;
  EXPECT_EQ(caller_max_bytes(options), 0u);
  for (const double percent : {0.5, 101.0, std::numeric_limits<double>::quiet_NaN()}) {
    options.max_bytes_per_caller = {.percent = percent};
    EXPECT_EQ(fault_of(Server::start(options).status()).element, "max_bytes_per_caller");
  }
}

TEST(ServerOptionsTest, AreChecked) {
  ServerOptions options;
  options.runner_threads = 1;
  EXPECT_TRUE(absl::IsInvalidArgument(Server::start(options).status()));
  options = {};
  for (const double rate :
       {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    options.max_stream_bytes_per_second = rate;
    EXPECT_EQ(fault_of(Server::start(options).status()).reason, "OPTION_OUT_OF_RANGE");
    options = {};
    options.max_stream_frames_per_second = rate;
    EXPECT_EQ(fault_of(Server::start(options).status()).reason, "OPTION_OUT_OF_RANGE");
    options = {};
  }
}

TEST(ServerAddress, MayBeASocketOfTheFileSystem) {
  ServerOptions options;
  options.address = "unix:" + testing::TempDir() + "lpdeform_test.sock";
  const auto server = Server::start(options);
  ASSERT_TRUE(server.ok()) << server.status();
  EXPECT_EQ((*server)->address(), options.address);
  EXPECT_TRUE(is_serving(options.address));
}

}  // namespace
}  // namespace lpdeform
