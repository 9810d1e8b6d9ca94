#include "server/calls/backend.h"

#include <algorithm>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/access/local_host.h"
#include "server/runtime/file_watch.h"
#include "server/runtime/heap_trim.h"
#include "server/wire/encode.h"

namespace lpdeform {
namespace {

constexpr int kPoolThreads = 4;
constexpr std::chrono::seconds kTrimPause{10};

std::shared_ptr<Timers> or_system(std::shared_ptr<Timers> timers) {
  return timers ? std::move(timers) : std::make_shared<SystemTimers>();
}

/// The longest life of a stream, for tokens that are valid for longer, for example because their date is in
/// milliseconds by mistake. A clock cannot count much further.
constexpr std::chrono::seconds kLongestStream = std::chrono::hours(24 * 365);

/// How often to check whether a stream whose token will expire still exists.
constexpr std::chrono::minutes kBetweenLooks{1};

void end_at(const std::shared_ptr<Timers>& timers, const std::weak_ptr<FrameStream>& weak,
            Timers::TimePoint when) {
  const auto look = [weak_timers = std::weak_ptr(timers), weak, when] {
    const auto stream = weak.lock();
    const auto again = weak_timers.lock();
    if (!stream || !again) return;
    if (again->now() < when) return end_at(again, weak, when);
    stream->end(EndReason::kTokenExpired, "The bearer token that the call came with has expired.");
  };
  timers->at(std::min(when, timers->now() + kBetweenLooks), look);
}

/// Whether only programs on this machine may call, and nothing else keeps others out.
bool is_for_this_machine(const ServerOptions& options) {
  return options.token_keys_file.empty() && !options.tls.knows_clients() && !options.allow_anonymous &&
         !absl::StartsWith(options.address, "unix:");
}

/// Clients start to count earlier than the server does, and gRPC rounds the deadline to about a hundredth.
bool is_reached(const CallContext::Deadline& deadline) {
  const auto slack = std::chrono::milliseconds(50) + deadline.given / 50;
  return deadline.when - slack <= std::chrono::system_clock::now();
}

std::string ended_because(EndReason reason) {
  if (reason == EndReason::kSessionExpired) return "expired";
  if (reason == EndReason::kElsewhere) return "elsewhere";
  return reason == EndReason::kDraining ? "draining" : "deleted";
}

/// Sums the log up periodically, because after a flood there may be no line that would do so.
void sum_up_later(const std::weak_ptr<Timers>& weak_timers, const std::weak_ptr<const Log>& weak_log) {
  const auto timers = weak_timers.lock();
  if (!timers) return;
  timers->at(timers->now() + Log::kWindow, [weak_timers, weak_log] {
    const auto log = weak_log.lock();
    if (!log) return;
    log->sum_up();
    sum_up_later(weak_timers, weak_log);
  });
}

}  // namespace

RefusedInput refused_input(const v1::Update& update) {
  return {update.input_seq(), update.handles_size() == 1 ? update.handles(0).name() : ""};
}

Backend::Backend(const ServerOptions& options, std::unique_ptr<Tokens> tokens)
    : timers(or_system(options.timers)),
      registry(std::make_shared<Registry>(timers, Registry::Limits{options.max_sessions, options.session_idle,
                                                                   options.max_sessions_per_caller})),
      options_(options),
      tokens_(std::move(tokens)),
      is_for_this_machine_(is_for_this_machine(options)),
      log_(options.log ? options.log : std::make_shared<Log>("off")),
      budget_(std::make_shared<Budget>(options.max_bytes, caller_max_bytes(options))),
      uploads_(
          std::make_shared<Uploads>(budget_, timers,
                                    Uploads::Limits{options.max_upload_bytes, options.upload_idle,
                                                    options.max_uploads, options.max_uploads_per_caller})),
      caller_limits_(std::make_shared<CallerLimits>(
          timers, CallerLimits::Limits{options.max_streams_per_caller, options.max_upload_bytes_per_second})),
      factory_(options, budget_, uploads_,
               {scheduler_,
                timers,
                options.heartbeat,
                metrics,
                {options.max_streams_per_session, {options.max_handles, options.max_undo}}}),
      scheduler_(options.runner_threads == 0 ? Scheduler::default_threads() : options.runner_threads,
                 observer(Span::kSchedulerQueue)),
      pool_(kPoolThreads, options.max_calls_waiting, observer(Span::kCallQueue)) {
  if (options.store) {
    keeper_ = Keeper::create(options.store, {timers, metrics, log_, options.session_idle});
    keeper_->on_lost = [registry = std::weak_ptr(registry)](const Session& session) {
      if (const auto self = registry.lock())
        self->remove(session, EndReason::kElsewhere, "Another server has the session now.");
    };
  }
  registry->on_ended = [log = log_, metrics = metrics, keeper = keeper_,
                        heap = std::make_shared<HeapTrim>(kTrimPause)](const Session& session,
                                                                       EndReason reason) {
    heap->after_release();
    const std::string why = ended_because(reason);
    metrics->session_ended(why);
    log->info("session_ended", {{"session", abbreviated(session.name())}, {"reason", why}});
    if (!keeper) return;
    if (goes_on(reason)) return keeper->release(session);
    if (reason == EndReason::kSessionExpired) return keeper->expire(session);
    keeper->remove(session.name());
  };
  metrics->set(Level::kSessionsMost, static_cast<double>(options.max_sessions));
  metrics->set(Level::kMemoryBytesMost, static_cast<double>(options.max_bytes));
  sum_up_later(timers, log_);
  if (tokens_) watch_files(timers, files_of("keys", tokens_), log_);
}

absl::StatusOr<Caller> Backend::identify(const CallContext& call, Access access) const {
  if (is_for_this_machine_ && !names_this_machine(call.authority)) {
    return make_fault(
        {Reason::kHostForeign, "host", "localhost"},
        absl::StrCat(
            "The server has no authentication, so it must be called localhost, 127.0.0.1 or [::1], and not '",
            absl::CHexEscape(call.authority), "'; --allow-anonymous lets everybody in."));
  }
  absl::StatusOr<Caller> caller = Caller{};
  if (tokens_ != nullptr && call.is_authorization_doubled) {
    return make_fault({Reason::kAuthorizationTwice, "authorization", "one header"},
                      "The call has the header authorization more than once; send it once.");
  }
  if (tokens_ != nullptr) {
    caller = tokens_->check(call.authorization, absl::ToUnixSeconds(absl::Now()));
  } else if (!call.peer_identity.empty()) {
    caller->subject = absl::StrCat("certificate:", call.peer_identity);
  }
  if (caller.ok() && call.is_route_doubled) {
    return make_fault({Reason::kRouteTwice, "lpdeform-session", "one header"},
                      "The call has the header lpdeform-session more than once; send it once.");
  }
  if (!caller.ok() || access == Access::kRead || !caller->is_viewer) return caller;
  return make_fault({Reason::kReadOnly, "authorization", ""}, "The bearer token is read-only.");
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

std::string Backend::metrics_text() {
  metrics->set(Level::kSessions, static_cast<double>(registry->size()));
  metrics->set(Level::kUploads, static_cast<double>(uploads_->size()));
  metrics->set(Level::kMemoryBytes, static_cast<double>(budget_->used()));
  metrics->set(Level::kOverloaded, scheduler_.is_overloaded() ? 1 : 0);
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
  if (absl::Status status = caller_limits_->take_upload_bytes(caller->subject, request.data().size());
      !status.ok()) {
    return status;
  }
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

void Backend::get_session(const CallContext& call, const v1::GetSessionRequest& request,
                          v1::GetSessionResponse& response, Done done) {
  with_session(call, Access::kRead, request.session(),
               [this, &response, done = std::move(done)](const auto& session) {
                 if (session.ok())
                   encode((*session)->info(), registry->idle(), timers->now(), *response.mutable_session());
                 done(session.status());
               });
}

void Backend::ack_frames(const CallContext& call, const v1::AckFramesRequest& request, v1::AckFramesResponse&,
                         Done done) {
  with_session(call, Access::kRead, request.session(),
               [&request, done = std::move(done)](const auto& session) {
                 done(session.ok() ? (*session)->acknowledge(request.stream_id(), request.frame_seq())
                                   : session.status());
               });
}

absl::StatusOr<Backend::OpenStream> Backend::open_stream(const CallContext& call,
                                                         std::shared_ptr<Session> session,
                                                         const std::string& token,
                                                         const v1::FrameOptions& options,
                                                         std::function<void()> wake) {
  const auto caller = identify(call, token.empty() ? Access::kRead : Access::kChange);
  if (!caller.ok()) return caller.status();
  auto decoded = decode_frame_options(options);
  if (!decoded.ok()) return decoded.status();
  decoded->max_bytes_per_second = options_.max_stream_bytes_per_second;
  if (const double most = options_.max_stream_frames_per_second; most > 0) {
    double& asked = decoded->max_frames_per_second;  // 0: without limit
    asked = asked > 0 ? std::min(asked, most) : most;
  }
  auto place = caller_limits_->enter_stream(session->owner());
  if (!place.ok()) return place.status();
  Change change{session, session->writer(token)};
  if (!token.empty() && !change.writer.ok()) return change.writer.status();
  const auto writer = change.writer.ok() ? std::make_optional(*change.writer) : std::nullopt;
  auto stream = session->open_stream(writer, *decoded);
  if (!stream.ok()) return stream.status();
  (*stream)->start(std::move(wake));
  metrics->change(Level::kStreams, 1);
  if (caller->until != 0) {
    const std::chrono::seconds left(caller->until + 1 - absl::ToUnixSeconds(absl::Now()));
    end_at(timers, *stream, timers->now() + std::min(left, kLongestStream));
  }
  const WriterLease lease = session->lease();
  log().info("stream_opened", {{"session", abbreviated(session->name())},
                               {"stream", abbreviated((*stream)->id())},
                               {"role", std::string(token.empty() ? "reader" : "writer")},
                               {"epoch", lease.epoch},
                               {"input_seq", lease.input_seq},
                               {"trace_id", call.trace_id}});
  return OpenStream{std::move(change), *std::move(stream), *std::move(place)};
}

void Backend::forget(const CallContext& call, const OpenStream& open, CallEnd how) {
  open.session()->forget_stream(*open.stream);
  metrics->change(Level::kStreams, -1);
  how.is_past_deadline = is_reached(call.deadline);
  how.unread = std::max<std::chrono::duration<double>>(how.unread, open.stream->waited_for_credit());
  const std::string reason = stream_end_name(stream_end_of(open.stream->ended_by(), how));
  metrics->stream_ended(reason);
  const WriterLease lease = open.session()->lease();
  log().info("stream_ended", {{"session", abbreviated(open.session()->name())},
                              {"stream", abbreviated(open.stream->id())},
                              {"reason", reason},
                              {"epoch", lease.epoch},
                              {"input_seq", lease.input_seq},
                              {"frame_seq", open.stream->last_frame_seq()},
                              {"unread_seconds", where_known(how.unread.count())},
                              {"fault", open.session()->standing_fault()},
                              {"trace_id", call.trace_id}});
}

absl::Status Backend::solve(const CallContext& call, const Change& change, const v1::SolveRequest& request,
                            SolveJob::OnProgress on_progress, SolveJob::OnDone on_done,
                            std::shared_ptr<SolveJob>& job) {
  const std::shared_ptr<Session>& session = change.session;
  Decoder decoder(*uploads_, session->vertex_count(), &session->features(), session->mesh().weld().get(),
                  session->owner());
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
    auto welded = session->mesh().solver_positions(*std::move(positions));
    if (!welded.ok()) return welded.status();
    options.initial_positions = *std::move(welded);
  }
  const SolveJob::OnDone on_ended = [this, session, trace_id = call.trace_id,
                                     on_done](absl::StatusOr<SolveResult> result) {
    if (result.ok()) log_solved(*session, *result, trace_id);
    // The result answers the update, so it is sent when the update is stored, which usually has happened long
    // before.
    when_kept(*session, session->revision(), [on_done, result](bool) { on_done(result); });
  };
  job = std::make_shared<SolveJob>(std::move(options), std::move(on_progress), on_ended);
  const absl::Status status = session->solve(change.writer, update, job);
  if (status.ok()) when_kept(*session, session->revision(), [](bool) {});
  return status;
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

}  // namespace lpdeform
