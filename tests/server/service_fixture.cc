#include "service_fixture.h"

#include <algorithm>

#include "core/base/crc32c.h"
#include "server/upload.h"

namespace lpdeform {
namespace {

constexpr std::size_t kInline = 1u << 20;

template <typename T>
std::optional<T> detail(const google::rpc::Status& status) {
  T message;
  for (const auto& any : status.details()) {
    if (any.UnpackTo(&message)) return message;
  }
  return std::nullopt;
}

void set_deadline(grpc::ClientContext& context) {
  context.set_deadline(std::chrono::system_clock::now() + kTestDeadline);
}

}  // namespace

std::string packed(const Points& points) {
  return {reinterpret_cast<const char*>(points.data()),
          static_cast<std::size_t>(points.size()) * sizeof(double)};
}

std::string packed(const Faces& faces) {
  return {reinterpret_cast<const char*>(faces.data()),
          static_cast<std::size_t>(faces.size()) * sizeof(std::int32_t)};
}

std::string packed(const std::vector<std::int32_t>& indices) {
  return {reinterpret_cast<const char*>(indices.data()), indices.size() * sizeof(std::int32_t)};
}

v1::Mesh mesh_message(const TriangleMesh& mesh) {
  v1::Mesh message;
  message.set_vertex_count(static_cast<std::uint32_t>(mesh.vertices.rows()));
  message.set_face_count(static_cast<std::uint32_t>(mesh.faces.rows()));
  message.set_scalar(v1::SCALAR_FLOAT64);
  message.mutable_data()->set_inline_(packed(mesh.vertices) + packed(mesh.faces));
  return message;
}

void set_handle(v1::Update& update, const std::string& name, const std::vector<std::int32_t>& vertices,
                double x) {
  v1::HandleUpdate& handle = *update.add_handles();
  handle.set_name(name);
  handle.mutable_set()->mutable_vertices()->set_inline_(packed(vertices));
  handle.mutable_set()->mutable_motion()->mutable_rigid()->mutable_translation()->set_x(x);
}

void move_handle(v1::Update& update, const std::string& name, double x) {
  v1::HandleUpdate& handle = *update.add_handles();
  handle.set_name(name);
  handle.mutable_move()->mutable_rigid()->mutable_translation()->set_x(x);
}

v1::Update ends_message(const Points& points, std::uint64_t input_seq, double x) {
  v1::Update update;
  update.set_input_seq(input_seq);
  set_handle(update, "base", vertices_at(points, 0), 0);
  set_handle(update, "tip", vertices_at(points, highest_z(points)), x);
  return update;
}

v1::Update tip_message(std::uint64_t input_seq, double x) {
  v1::Update update;
  update.set_input_seq(input_seq);
  move_handle(update, "tip", x);
  return update;
}

void solve_slowly(v1::Update& update) {
  v1::SettingsUpdate& settings = *update.mutable_settings();
  settings.mutable_p()->set_uniform(1.0);
  settings.mutable_solver()->set_method(v1::METHOD_LINE_SEARCH);
  settings.mutable_solver()->set_tolerance(1e-14);
  settings.mutable_solver()->set_max_iterations(2'000'000'000);
}

ErrorDetails details_of(const grpc::Status& status) {
  google::rpc::Status message;
  EXPECT_TRUE(message.ParseFromString(status.error_details()));
  EXPECT_EQ(message.code(), static_cast<int>(status.error_code()));
  EXPECT_EQ(message.message(), status.error_message());
  ErrorDetails details;
  const auto info = detail<google::rpc::ErrorInfo>(message);
  EXPECT_TRUE(info.has_value()) << status.error_message();
  if (info) details.info = *info;
  EXPECT_EQ(details.info.domain(), "lpdeform");
  details.bad_request = detail<google::rpc::BadRequest>(message);
  details.retry = detail<google::rpc::RetryInfo>(message);
  details.quota = detail<google::rpc::QuotaFailure>(message);
  details.resource = detail<google::rpc::ResourceInfo>(message);
  return details;
}

std::optional<ReceivedFrame> FrameAssembler::add(const v1::FramePart& part) {
  EXPECT_LE(part.ByteSizeLong(), kInline);
  if (part.has_header()) {
    frame_ = {};
    frame_.header = part.header();
    vertices_ = 0;
  }
  EXPECT_EQ(part.frame_seq(), frame_.header.frame_seq());
  EXPECT_EQ(part.first_vertex(), vertices_);
  const std::size_t scalar = frame_.header.scalar() == v1::SCALAR_FLOAT64 ? 8 : 4;
  EXPECT_EQ(part.positions().size(), std::size_t{part.vertex_count()} * 3 * scalar);
  vertices_ += part.vertex_count();
  frame_.positions += part.positions();
  frame_.distortion += part.distortion();
  frame_.normals += part.normals();
  ++frame_.parts;
  if (!part.last()) return std::nullopt;
  EXPECT_EQ(vertices_, frame_.header.vertex_count());
  return std::move(frame_);
}

void expect_invariants(const History& history, std::size_t credit) {
  for (std::size_t k = 1; k < history.frames.size(); ++k) {
    const v1::FrameHeader &before = history.frames[k - 1], &after = history.frames[k];
    EXPECT_GE(after.epoch(), before.epoch());
    EXPECT_TRUE(after.epoch() > before.epoch() || after.frame_seq() > before.frame_seq());
    EXPECT_GE(after.input_seq(), before.input_seq());
  }
  EXPECT_LE(history.most_in_flight, credit);
  const std::size_t reasons = history.ends.size() + (history.status && !history.status->ok() ? 1 : 0);
  if (history.status) {
    EXPECT_EQ(reasons, 1u) << history.status->error_message();
  } else {
    EXPECT_LE(reasons, 1u);
  }
  EXPECT_EQ(history.after_end, 0);
  EXPECT_LE(history.opened, 1);
}

DeformClient::DeformClient(v1::DeformService::Stub& stub, const v1::CreateSessionResponse& session,
                           v1::FrameOptions options, bool is_writer) {
  set_deadline(context_);
  stream_ = stub.Deform(&context_);
  v1::DeformRequest request;
  request.mutable_open()->set_session(session.session().name());
  if (is_writer) request.mutable_open()->set_writer_token(session.writer_token());
  *request.mutable_open()->mutable_options() = std::move(options);
  stream_->Write(request);
}

DeformClient::~DeformClient() {
  context_.TryCancel();
  read_to_end();
}

bool DeformClient::send(const v1::Update& update) {
  v1::DeformRequest request;
  *request.mutable_update() = update;
  return stream_->Write(request);
}

bool DeformClient::acknowledge(std::uint64_t frame_seq) {
  history.in_flight = 0;
  v1::DeformRequest request;
  request.mutable_ack()->set_frame_seq(frame_seq);
  return stream_->Write(request);
}

std::optional<v1::DeformResponse> DeformClient::read() {
  if (history.status) return std::nullopt;
  v1::DeformResponse response;
  if (!stream_->Read(&response)) return std::nullopt;
  if (!history.ends.empty()) ++history.after_end;
  if (response.has_result()) history.results.push_back(response.result());
  const v1::StreamEvent& event = response.event();
  if (event.has_opened()) ++history.opened;
  if (event.has_heartbeat()) ++history.heartbeats;
  if (event.has_fault()) history.faults.push_back(event.fault());
  if (event.has_go_away()) history.ends.push_back(event.go_away());
  if (event.has_frame() && event.frame().has_header()) {
    history.frames.push_back(event.frame().header());
    history.most_in_flight = std::max(history.most_in_flight, ++history.in_flight);
  }
  return response;
}

std::optional<ReceivedFrame> DeformClient::next_frame(bool acknowledges) {
  while (const auto response = read()) {
    if (!response->event().has_frame()) continue;
    auto frame = assembler_.add(response->event().frame());
    if (!frame) continue;
    if (acknowledges) acknowledge(frame->header.frame_seq());
    return frame;
  }
  return std::nullopt;
}

std::optional<ReceivedFrame> DeformClient::settle(std::uint64_t input_seq) {
  while (auto frame = next_frame()) {
    if (frame->header.is_final() && frame->header.input_seq() >= input_seq) return frame;
  }
  return std::nullopt;
}

grpc::Status DeformClient::read_to_end() {
  while (read()) {
  }
  if (!history.status) history.status = stream_->Finish();
  return *history.status;
}

void ServiceTest::start() {
  options_.timers = timers_;
  auto server = Server::start(options_);
  ASSERT_TRUE(server.ok()) << server.status();
  server_ = *std::move(server);
  stub_ = connect();
}

std::unique_ptr<v1::DeformService::Stub> ServiceTest::connect() const {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return v1::DeformService::NewStub(
      grpc::CreateCustomChannel(server_->address(), grpc::InsecureChannelCredentials(), arguments));
}

grpc::Status ServiceTest::try_create(const v1::CreateSessionRequest& request,
                                     v1::CreateSessionResponse& response) {
  grpc::ClientContext context;
  set_deadline(context);
  return stub_->CreateSession(&context, request, &response);
}

v1::CreateSessionResponse ServiceTest::create(const TriangleMesh& mesh) {
  v1::CreateSessionRequest request;
  *request.mutable_mesh() = mesh_message(mesh);
  if (request.mesh().data().inline_().size() > kInline) {
    const std::string bytes = request.mesh().data().inline_();
    request.mutable_mesh()->mutable_data()->set_upload(upload(bytes));
  }
  v1::CreateSessionResponse response;
  const grpc::Status status = try_create(request, response);
  EXPECT_TRUE(status.ok()) << status.error_message();
  return response;
}

std::string ServiceTest::upload(std::string_view bytes) {
  v1::CreateUploadRequest announce;
  announce.set_size_bytes(bytes.size());
  announce.set_crc32c(crc32c(bytes));
  v1::CreateUploadResponse created;
  {
    grpc::ClientContext context;
    set_deadline(context);
    EXPECT_TRUE(stub_->CreateUpload(&context, announce, &created).ok());
  }
  v1::UploadPartResponse answer;
  for (std::size_t offset = 0; offset < bytes.size(); offset += created.max_part_bytes()) {
    v1::UploadPartRequest part;
    part.set_upload(created.upload());
    part.set_offset(offset);
    part.set_data(std::string(bytes.substr(offset, created.max_part_bytes())));
    grpc::ClientContext context;
    set_deadline(context);
    EXPECT_TRUE(stub_->UploadPart(&context, part, &answer).ok());
  }
  EXPECT_TRUE(answer.finished());
  return created.upload();
}

grpc::Status ServiceTest::update(const v1::CreateSessionResponse& session, const v1::Update& update) {
  v1::UpdateHandlesRequest request;
  request.set_session(session.session().name());
  request.set_writer_token(session.writer_token());
  *request.mutable_update() = update;
  v1::UpdateHandlesResponse response;
  grpc::ClientContext context;
  set_deadline(context);
  return stub_->UpdateHandles(&context, request, &response);
}

v1::SolveRequest ServiceTest::solve_request(const v1::CreateSessionResponse& session) const {
  v1::SolveRequest request;
  request.set_session(session.session().name());
  request.set_writer_token(session.writer_token());
  return request;
}

SolveOutcome ServiceTest::solve(const v1::SolveRequest& request, grpc::ClientContext* context) {
  grpc::ClientContext own;
  if (context == nullptr) {
    set_deadline(own);
    context = &own;
  }
  SolveOutcome outcome;
  FrameAssembler assembler;
  v1::SolveResponse response;
  const auto stream = stub_->Solve(context, request);
  while (stream->Read(&response)) {
    if (response.has_heartbeat()) continue;
    if (response.has_progress()) {
      outcome.progress.push_back(response.progress());
      outcome.order.push_back('p');
    } else if (response.has_summary()) {
      outcome.summary = response.summary();
      outcome.order.push_back('s');
    } else if (response.has_trace()) {
      EXPECT_LE(response.ByteSizeLong(), kInline);
      outcome.trace.insert(outcome.trace.end(), response.trace().records().begin(),
                           response.trace().records().end());
      outcome.order.push_back('t');
    } else {
      outcome.frame = assembler.add(response.frame());
      outcome.order.push_back('f');
    }
  }
  outcome.status = stream->Finish();
  return outcome;
}

}  // namespace lpdeform
