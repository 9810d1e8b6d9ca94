#include "server/calls/solve_call.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "server/calls/write_pump.h"
#include "server/wire/encode.h"

namespace lpdeform {
namespace {

/// Sends the newest progress while the solver runs; then the summary, the trace and the result. From the
/// beginning of the call it sends heartbeats whenever nothing else is sent.
class SolveCall final : public WritePump<SolveReactor, Outgoing<v1::SolveResponse>> {
 public:
  explicit SolveCall(Backend& backend) : backend_(backend), last_sent_at_(backend.timers->now()) {}

  void begin(const v1::SolveRequest& request) {
    beat_at(last_sent_at_ + backend_.heartbeat());
    auto self = std::static_pointer_cast<SolveCall>(shared_from_this());
    // A copy, because gRPC destroys its own when the call is cancelled.
    const auto task = [self, request] {
      self->backend_.with_session(
          self->context(), Backend::Access::kChange, request.session(), [self, request](const auto& session) {
            session.ok() ? self->decode(*session, request) : self->refuse(session.status());
          });
    };
    if (!backend_.pool().try_post(task)) refuse(server_busy(backend_.pool().expected_wait()));
  }

 private:
  static constexpr std::size_t kRecordsAMessage = 1000;  // of about 40 bytes each

  std::weak_ptr<SolveCall> weak() { return std::static_pointer_cast<SolveCall>(shared_from_this()); }

  void beat_at(Timers::TimePoint when) {
    backend_.timers->at(when, [weak = weak()] {
      if (const auto self = weak.lock()) self->beat();
    });
  }

  void beat() {
    const std::scoped_lock lock(mutex_);
    if (is_over_locked()) return;
    const Timers::TimePoint now = backend_.timers->now();
    is_beat_due_ = now - last_sent_at_ >= backend_.heartbeat();
    pump_locked();
    // If a write is under way, the heartbeat is still due, but the reader has something to read.
    beat_at((is_beat_due_ ? now : last_sent_at_) + backend_.heartbeat());
  }

  void decode(const std::shared_ptr<Session>& session, const v1::SolveRequest& request) {
    auto self = std::static_pointer_cast<SolveCall>(shared_from_this());
    record().about(session);
    const Backend::Change change{session, session->writer(request.writer_token())};
    if (request.has_update()) record().about(refused_input(request.update()));
    backend_.when_decodable(change, request.update(), [self, change, request](const absl::Status& status) {
      status.ok() ? self->start(change, request) : self->refuse(status);
    });
  }

  void start(const Backend::Change& change, const v1::SolveRequest& request) {
    {
      const std::scoped_lock lock(mutex_);
      if (is_over_locked()) return;
      format_ = request.scalar() == v1::SCALAR_FLOAT64 ? Format::kFloat64 : Format::kFloat32;
      with_normals_ = request.normals();
    }
    SolveJob::OnProgress on_progress;
    if (request.progress()) {
      on_progress = [weak = weak()](const SolveProgress& progress) {
        if (const auto self = weak.lock()) self->show(progress);
      };
    }
    const auto on_done = [weak = weak()](absl::StatusOr<SolveResult> result) {
      if (const auto self = weak.lock()) self->end(std::move(result));
    };
    std::shared_ptr<SolveJob> job;
    absl::Status status = decode_scalar(request.scalar()).status();
    if (status.ok())
      status = backend_.solve(context(), change, request, std::move(on_progress), on_done, job);
    if (!status.ok()) return refuse(status);
    const std::scoped_lock lock(mutex_);
    job_ = std::move(job);
    if (is_over_locked()) job_->abandon();
  }

  void show(const SolveProgress& progress) {
    const std::scoped_lock lock(mutex_);
    progress_ = progress;
    pump_locked();
  }

  void end(absl::StatusOr<SolveResult> result) {
    if (!result.ok()) return refuse(result.status());
    result->frame->surface->prepare(format_, with_normals_);
    const std::scoped_lock lock(mutex_);
    progress_.reset();
    cutter_ = FrameCutter(result->frame, format_, true, with_normals_, 0);
    result_ = *std::move(result);
    pump_locked();
  }

  Made make(Outgoing<v1::SolveResponse>& response) override {
    if (progress_) {
      response.message.mutable_progress()->set_iteration(progress_->iteration);
      response.message.mutable_progress()->set_energy(progress_->energy);
      response.message.mutable_progress()->set_seconds(progress_->seconds);
      progress_.reset();
      return Made::kMessage;
    }
    if (!result_) {
      if (!is_beat_due_) return Made::kNothing;
      response.message.mutable_heartbeat();
      return Made::kMessage;
    }
    const std::vector<IterationRecord>& trace = result_->summary.trace;
    if (!std::exchange(is_summary_sent_, true)) {
      encode(*result_, *response.message.mutable_summary());
    } else if (records_sent_ < trace.size()) {
      const std::size_t end = std::min(trace.size(), records_sent_ + kRecordsAMessage);
      encode_trace(trace, records_sent_, end, *response.message.mutable_trace());
      records_sent_ = end;
    } else {
      encode(cutter_.next(), response);
      if (!cutter_.has_more()) return Made::kLastMessage;
    }
    return Made::kMessage;
  }

  void on_made() override {
    last_sent_at_ = backend_.timers->now();
    is_beat_due_ = false;
  }

  void release() override {
    if (job_) job_->abandon();
  }

  Backend& backend_;
  Timers::TimePoint last_sent_at_;  // when the last write was begun
  bool is_beat_due_ = false;
  Format format_ = Format::kFloat32;
  bool with_normals_ = false;
  std::shared_ptr<SolveJob> job_;
  std::optional<SolveProgress> progress_;
  std::optional<SolveResult> result_;
  bool is_summary_sent_ = false;
  std::size_t records_sent_ = 0;
  FrameCutter cutter_;
};

}  // namespace

SolveReactor* solve(Backend& backend, std::shared_ptr<CallRecord> record, const v1::SolveRequest& request) {
  return begin_call<SolveCall>(backend, std::move(record), request);
}

}  // namespace lpdeform
