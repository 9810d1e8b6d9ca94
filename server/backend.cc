#include "server/backend.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/fault.h"
#include "core/base/workers.h"
#include "server/encode.h"
#include "server/key_watch.h"
#include "server/random_name.h"

namespace lpdeform {
namespace {

constexpr int kPoolThreads = 4;
constexpr std::uint32_t kDefaultPage = 100, kLargestPage = 1000;
constexpr std::uint32_t kFacesPerVertex = 3;

/// What a session is taken to need until it is known: about what a triangulated surface needs, factored by
/// CHOLMOD.
constexpr std::size_t kBytesPerVertex = 2600, kBytesPerFace = 100;

std::shared_ptr<Timers> or_system(std::shared_ptr<Timers> timers) {
  return timers ? std::move(timers) : std::make_shared<SystemTimers>();
}

std::string ended_because(EndReason reason) {
  if (reason == EndReason::kSessionExpired) return "expired";
  return reason == EndReason::kDraining ? "draining" : "deleted";
}

}  // namespace

Backend::Backend(const ServerOptions& options, std::unique_ptr<Tokens> tokens)
    : timers(or_system(options.timers)),
      registry(std::make_shared<Registry>(timers, Registry::Limits{options.max_sessions, options.session_idle,
                                                                   options.max_sessions_per_caller})),
      options_(options),
      tokens_(std::move(tokens)),
      log_(options.log ? options.log : std::make_shared<Log>("off")),
      budget_(std::make_shared<Budget>(options.max_bytes)),
      uploads_(std::make_shared<Uploads>(
          budget_, timers,
          Uploads::Limits{options.max_upload_bytes, options.upload_idle, options.max_uploads})),
      scheduler(options.runner_threads == 0 ? Scheduler::default_threads() : options.runner_threads,
                observer(Span::kSchedulerQueue)),
      pool(kPoolThreads, options.max_calls_waiting, observer(Span::kCallQueue)) {
  registry->on_ended = [log = log_, metrics = metrics](const Session& session, EndReason reason) {
    const std::string why = ended_because(reason);
    metrics->session_ended(why);
    log->info("session_ended", {{"session", abbreviated(session.name())}, {"reason", why}});
  };
  metrics->set(Level::kSessionsMost, static_cast<double>(options.max_sessions));
  metrics->set(Level::kMemoryBytesMost, static_cast<double>(options.max_bytes));
  if (tokens_) watch_keys(timers, tokens_, log_);
}

absl::StatusOr<Caller> Backend::identify(const CallContext& call, Access access) const {
  absl::StatusOr<Caller> caller = Caller{};
  if (tokens_ != nullptr) {
    caller = tokens_->check(call.authorization, absl::ToUnixSeconds(absl::Now()));
  } else if (!call.peer_identity.empty()) {
    caller->subject = absl::StrCat("certificate:", call.peer_identity);
  }
  if (!caller.ok() || access == Access::kRead || !caller->is_viewer) return caller;
  return make_fault(absl::StatusCode::kPermissionDenied, {"READ_ONLY", "authorization", ""},
                    "The bearer token lets its holder look on and change nothing.");
}

absl::StatusOr<std::shared_ptr<Session>> Backend::find(const CallContext& call, Access access,
                                                       const std::string& name) const {
  const auto caller = identify(call, access);
  if (!caller.ok()) return caller.status();
  return registry->find(name, caller->subject);
}

std::function<void(double)> Backend::observer(Span span) const {
  return [metrics = metrics, span](double seconds) { metrics->observe(span, seconds); };
}

std::string Backend::metrics_text() const {
  metrics->set(Level::kSessions, static_cast<double>(registry->size()));
  metrics->set(Level::kUploads, static_cast<double>(uploads_->size()));
  metrics->set(Level::kMemoryBytes, static_cast<double>(budget_->used()));
  metrics->set(Level::kDraining, gate.is_closed() ? 1 : 0);
  return metrics->text();
}

std::shared_ptr<CallRecord> Backend::begin_record(std::string method, CallContext context) {
  return std::make_shared<CallRecord>(CallRecord::Services{gate, metrics, log_}, std::move(method),
                                      std::move(context));
}

absl::Status Backend::create_upload(const CallContext& call, const v1::CreateUploadRequest& request,
                                    v1::CreateUploadResponse& response) {
  const auto caller = identify(call, Access::kChange);
  if (!caller.ok()) return caller.status();
  const auto upload =
      uploads_->create(request.request_id(), request.size_bytes(), request.crc32c(), caller->subject);
  if (!upload.ok()) return upload.status();
  response.set_upload((*upload)->name());
  response.set_max_part_bytes(Upload::kMostPartBytes);
  return absl::OkStatus();
}

absl::Status Backend::upload_part(const CallContext& call, const v1::UploadPartRequest& request,
                                  v1::UploadPartResponse& response) {
  const auto caller = identify(call, Access::kChange);
  if (!caller.ok()) return caller.status();
  const auto upload = uploads_->find(request.upload(), caller->subject);
  if (!upload.ok()) return upload.status();
  const auto progress = (*upload)->add(request.offset(), request.data());
  if (!progress.ok()) return progress.status();
  response.set_received_bytes(progress->received_bytes);
  response.set_finished(progress->is_finished);
  return absl::OkStatus();
}

absl::Status Backend::delete_upload(const CallContext& call, const v1::DeleteUploadRequest& request,
                                    v1::DeleteUploadResponse&) {
  const auto caller = identify(call, Access::kChange);
  if (!caller.ok()) return caller.status();
  uploads_->remove(request.upload(), caller->subject);
  return absl::OkStatus();
}

absl::Status Backend::get_session(const CallContext& call, const v1::GetSessionRequest& request,
                                  v1::GetSessionResponse& response) {
  const auto session = find(call, Access::kRead, request.session());
  if (!session.ok()) return session.status();
  encode((*session)->info(), registry->idle(), timers->now(), *response.mutable_session());
  return absl::OkStatus();
}

absl::Status Backend::list_sessions(const CallContext& call, const v1::ListSessionsRequest& request,
                                    v1::ListSessionsResponse& response) {
  if (request.page_size() > kLargestPage) {
    return invalid_input(
        {"PAGE_SIZE", "page_size", absl::StrCat("page_size <= ", kLargestPage)},
        absl::StrCat("A page of ", request.page_size(), " sessions is over ", kLargestPage, "."));
  }
  const auto caller = identify(call, Access::kRead);
  if (!caller.ok()) return caller.status();
  const auto page = registry->list(request.page_size() == 0 ? kDefaultPage : request.page_size(),
                                   request.page_token(), caller->subject);
  if (!page.ok()) return page.status();
  for (const auto& session : page->sessions) {
    v1::Session& listed = *response.add_sessions();
    encode(session->info(), registry->idle(), timers->now(), listed);
    listed.clear_handles();
    listed.mutable_mesh()->clear_defects();
  }
  response.set_next_page_token(page->next_page_token);
  return absl::OkStatus();
}

absl::Status Backend::delete_session(const CallContext& call, const v1::DeleteSessionRequest& request,
                                     v1::DeleteSessionResponse&) {
  const auto session = find(call, Access::kChange, request.session());
  if (absl::IsNotFound(session.status())) return absl::OkStatus();
  if (!session.ok()) return session.status();
  if (registry->remove(request.session(), EndReason::kSessionDeleted, "The session was deleted.")) {
    log().info("session_deleted", {{"session", abbreviated(request.session())}, {"trace_id", call.trace_id}});
  }
  return absl::OkStatus();
}

absl::Status Backend::acquire_writer(const CallContext& call, const v1::AcquireWriterRequest& request,
                                     v1::AcquireWriterResponse& response) {
  const auto session = find(call, Access::kChange, request.session());
  if (!session.ok()) return session.status();
  const WriterLease lease = (*session)->acquire_writer();
  response.set_writer_token(lease.token);
  response.set_epoch(lease.epoch);
  response.set_input_seq(lease.input_seq);
  log().info("writer_replaced", {{"session", abbreviated(request.session())},
                                 {"epoch", lease.epoch},
                                 {"input_seq", lease.input_seq},
                                 {"trace_id", call.trace_id}});
  return absl::OkStatus();
}

absl::Status Backend::update_handles(const CallContext& call, const v1::UpdateHandlesRequest& request,
                                     v1::UpdateHandlesResponse& response) {
  const auto session = find(call, Access::kChange, request.session());
  if (!session.ok()) return session.status();
  const auto result = update(call, **session, request.writer_token(), request.update());
  if (!result.ok()) return result.status();
  response.mutable_result()->set_input_seq(result->input_seq);
  response.mutable_result()->set_stale_parts(result->stale_parts);
  return absl::OkStatus();
}

absl::Status Backend::ack_frames(const CallContext& call, const v1::AckFramesRequest& request,
                                 v1::AckFramesResponse&) {
  const auto session = find(call, Access::kRead, request.session());
  return session.ok() ? (*session)->acknowledge(request.stream_id(), request.frame_seq()) : session.status();
}

absl::StatusOr<Backend::OpenStream> Backend::open_stream(const CallContext& call,
                                                         const std::string& session_name,
                                                         const std::string& token,
                                                         const v1::FrameOptions& options,
                                                         std::function<void()> wake) {
  auto session = find(call, token.empty() ? Access::kRead : Access::kChange, session_name);
  if (!session.ok()) return session.status();
  auto decoded = decode_frame_options(options);
  if (!decoded.ok()) return decoded.status();
  decoded->max_bytes_per_second = options_.max_stream_bytes_per_second;
  auto stream = (*session)->open_stream(token, *decoded);
  if (!stream.ok()) return stream.status();
  (*stream)->start(std::move(wake));
  metrics->change(Level::kStreams, 1);
  const WriterLease lease = (*session)->lease();
  log().info("stream_opened", {{"session", abbreviated(session_name)},
                               {"stream", abbreviated((*stream)->id())},
                               {"role", std::string(token.empty() ? "reader" : "writer")},
                               {"epoch", lease.epoch},
                               {"input_seq", lease.input_seq},
                               {"trace_id", call.trace_id}});
  return OpenStream{*std::move(session), *std::move(stream)};
}

void Backend::forget(const CallContext& call, const OpenStream& open) {
  open.session->forget_stream(*open.stream);
  metrics->change(Level::kStreams, -1);
  const WriterLease lease = open.session->lease();
  log().info("stream_ended", {{"session", abbreviated(open.session->name())},
                              {"stream", abbreviated(open.stream->id())},
                              {"epoch", lease.epoch},
                              {"input_seq", lease.input_seq},
                              {"frame_seq", open.stream->last_frame_seq()},
                              {"trace_id", call.trace_id}});
}

absl::StatusOr<UpdateResult> Backend::update(const CallContext& call, Session& session,
                                             const std::string& token, const v1::Update& update) {
  if (absl::Status status = session.check_writer(token); !status.ok()) return status;
  const auto decoded = Decoder(*uploads_, session.vertex_count(), &session.features(),
                               session.mesh().weld().get(), session.owner())
                           .update(update);
  if (!decoded.ok()) return decoded.status();
  const auto result = session.update(token, *decoded);
  if (result.ok()) {
    log().debug("update", {{"session", abbreviated(session.name())},
                           {"epoch", session.lease().epoch},
                           {"input_seq", result->input_seq},
                           {"stale_parts", std::uint64_t{result->stale_parts}},
                           {"trace_id", call.trace_id}});
  }
  return result;
}

absl::Status Backend::solve(const CallContext& call, const v1::SolveRequest& request,
                            SolveJob::OnProgress on_progress, SolveJob::OnDone on_done,
                            std::shared_ptr<SolveJob>& job) {
  const auto session = find(call, Access::kChange, request.session());
  if (!session.ok()) return session.status();
  if (absl::Status status = (*session)->check_writer(request.writer_token()); !status.ok()) return status;
  Decoder decoder(*uploads_, (*session)->vertex_count(), &(*session)->features(),
                  (*session)->mesh().weld().get(), (*session)->owner());
  std::optional<Update> update;
  if (request.has_update()) {
    auto decoded = decoder.update(request.update());
    if (!decoded.ok()) return decoded.status();
    update = *std::move(decoded);
  }
  SolveOptions options{request.certify(), request.trace(), std::nullopt};
  if (request.has_initial_positions()) {
    auto positions = decoder.positions(request.initial_positions());
    if (!positions.ok()) return positions.status();
    auto welded = (*session)->mesh().solver_positions(*std::move(positions));
    if (!welded.ok()) return welded.status();
    options.initial_positions = *std::move(welded);
  }
  const SolveJob::OnDone on_ended = [this, session = *session, trace_id = call.trace_id,
                                     on_done](absl::StatusOr<SolveResult> result) {
    if (result.ok()) log_solved(*session, *result, trace_id);
    on_done(std::move(result));
  };
  job = std::make_shared<SolveJob>(std::move(options), std::move(on_progress), on_ended);
  return (*session)->solve(request.writer_token(), update, job);
}

void Backend::log_solved(const Session& session, const SolveResult& result,
                         const std::string& trace_id) const {
  log().info("solved", {{"session", abbreviated(session.name())},
                        {"epoch", result.frame->epoch},
                        {"input_seq", result.frame->input_seq},
                        {"frame_seq", result.frame->frame_seq},
                        {"iterations", static_cast<std::uint64_t>(result.summary.iterations)},
                        {"seconds", result.summary.solve_seconds},
                        {"stop_reason", std::string(stop_reason_name(result.summary.stop_reason))},
                        {"trace_id", trace_id}});
}

void Backend::create_session(const CallContext& call, const v1::CreateSessionRequest& request,
                             v1::CreateSessionResponse& response, std::function<void(absl::Status)> done) {
  const auto caller = identify(call, Access::kChange);
  if (!caller.ok()) return done(caller.status());
  const Registry::OnCreated on_created = [this, &response,
                                          done](const absl::StatusOr<CreatedSession>& created) {
    if (!created.ok()) return done(created.status());
    encode(created->session->info(), registry->idle(), timers->now(), *response.mutable_session());
    response.set_writer_token(created->writer_token);
    done(absl::OkStatus());
  };
  const std::size_t fingerprint = std::hash<std::string>()(request.SerializeAsString());
  if (!registry->begin_creation(request.request_id(), on_created, fingerprint, caller->subject)) return;
  scheduler.run_once([this, call, owner = caller->subject, &request, on_created] {
    const std::string request_id = request.request_id();
    registry->finish_creation(request_id, make_session(call, owner, request), on_created, owner);
  });
}

absl::Status Backend::make_mesh(const v1::CreateSessionRequest& request, Decoder& decoder,
                                SessionParts& parts) {
  const auto weights = decode_weights(request.weights());
  if (!weights.ok()) return weights.status();
  auto mesh = decoder.mesh(request.mesh());
  if (!mesh.ok()) return mesh.status();
  auto normals = decoder.normals(request.normals());
  if (!normals.ok()) return normals.status();
  const auto weld = decoder.weld(request.weld(), mesh->vertices);
  if (!weld.ok()) return weld.status();

  auto shape = RestShape::create(*weld ? welded(*mesh, **weld) : *mesh, *weights);
  // What is wrong is said of the client's vertices where it can be.
  if (!shape.ok() && *weld) {
    if (absl::Status status = deformable(check_mesh(*mesh)); !status.ok()) return status;
  }
  if (!shape.ok()) return shape.status();
  parts.shape = *std::move(shape);
  parts.mesh =
      std::make_shared<const DrawMesh>(parts.shape, *weld, std::move(mesh->faces), *std::move(normals));
  return absl::OkStatus();
}

absl::StatusOr<std::shared_ptr<Session>> Backend::make_session(const CallContext& call,
                                                               const std::string& owner,
                                                               const v1::CreateSessionRequest& request) {
  const v1::Mesh& mesh_message = request.mesh();
  Decoder decoder(*uploads_, mesh_message.vertex_count(), nullptr, nullptr, owner);
  const std::uint32_t most_faces = kFacesPerVertex * options_.max_vertices;
  if (absl::Status status = decoder.check_mesh_size(mesh_message, {options_.max_vertices, most_faces});
      !status.ok()) {
    return status;
  }
  const auto free_components = decode_free_components(request.free_components());
  if (!free_components.ok()) return free_components.status();
  auto memory = budget_->reserve(kBytesPerVertex * mesh_message.vertex_count() +
                                 kBytesPerFace * mesh_message.face_count());
  if (!memory.ok()) return memory.status();

  SessionParts parts;
  parts.name = absl::StrCat("sessions/", random_hex_128());
  parts.owner = owner;
  parts.free_components = *free_components;
  parts.memory = *std::move(memory);
  if (absl::Status status = make_mesh(request, decoder, parts); !status.ok()) return status;
  const int threads = options_.threads == 0 ? available_cores() : options_.threads;
  parts.features = std::make_shared<const ShapeFeatures>(parts.shape, Workers(threads));
  Decoder inputs(*uploads_, mesh_message.vertex_count(), parts.features.get(), parts.mesh->weld().get(),
                 owner);
  if (absl::Status status = inputs.handles(request.handles(), parts.beginning); !status.ok()) return status;
  auto settings = inputs.settings(request.settings());
  if (!settings.ok()) return settings.status();
  parts.beginning.settings = *std::move(settings);
  auto deformer = Deformer::create(parts.shape, {*free_components, threads});
  if (!deformer.ok()) return deformer.status();
  parts.deformer = *std::move(deformer);
  auto session =
      Session::create(std::move(parts), {scheduler,
                                         timers,
                                         options_.heartbeat,
                                         metrics,
                                         {options_.max_streams_per_session, options_.max_handles}});
  if (!session.ok()) return session.status();
  metrics->add(Count::kSessionsCreated);
  log().info("session_created", {{"session", abbreviated((*session)->name())},
                                 {"epoch", (*session)->lease().epoch},
                                 {"vertices", std::uint64_t{mesh_message.vertex_count()}},
                                 {"faces", std::uint64_t{mesh_message.face_count()}},
                                 {"trace_id", call.trace_id}});
  return session;
}

}  // namespace lpdeform
