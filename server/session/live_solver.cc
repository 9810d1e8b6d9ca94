#include "server/session/live_solver.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/constraints/check_positions.h"
#include "core/problem/check_handle.h"
#include "server/runtime/metrics.h"

namespace lpdeform {
namespace {

absl::Status superseded(std::uint64_t input_seq) {
  return make_fault({Reason::kSuperseded, absl::StrCat("update ", input_seq), ""},
                    absl::StrCat("Update ", input_seq, " came before the solve was finished."));
}

}  // namespace

LiveSolver::LiveSolver(std::unique_ptr<Deformer> deformer, const Mailbox& mailbox, Publisher& publisher,
                       std::shared_ptr<const DrawMesh> mesh, Alarm alarm, std::stop_token stop)
    : deformer_(std::move(deformer)),
      mailbox_(mailbox),
      publisher_(publisher),
      mesh_(std::move(mesh)),
      alarm_(std::move(alarm)),
      stop_(std::move(stop)) {
  publish(mailbox_.newest().handles->handles().empty());
}

bool LiveSolver::run_slice(SolveJob* job, const Pace& pace) {
  const Inputs newest = mailbox_.newest();
  if (job != nullptr && newest.version > job->version) job->finish(superseded(newest.input_seq));
  if (job != nullptr && job->is_done()) job = nullptr;
  if (publisher_.is_better_taken()) {
    withdraw_better();
    if (newest.version == inputs_.version) offer_better();  // what was found while that one was being taken
  }
  if (newest.version != inputs_.version) take_over(newest);

  const std::uint64_t wanted = job != nullptr                  ? job->number()
                               : publisher_.reader_count() > 0 ? kReaders
                                                               : kNobody;
  if (phase_ == Phase::kRunning && running_for_ != wanted) pause();
  if (wanted == kNobody) return false;
  if (wanted == kReaders && (phase_ == Phase::kAnswered || phase_ == Phase::kCertifying)) {
    if (publisher_.is_certificate_wanted() && !deformer_->is_searching()) return look_for_certificate();
  }
  const bool is_over = phase_ != Phase::kWaiting && phase_ != Phase::kRunning;
  if (wanted == kReaders && is_over && is_search_due_) return look_for_better(pace);
  if (phase_ != Phase::kRunning) {
    if (!(job != nullptr ? begin_job(*job) : begin_live())) return false;
    phase_ = Phase::kRunning;
    running_for_ = wanted;
    was_begun_ = true;
    if (job == nullptr && is_guess_due(pace)) publish(false);
  }
  run_steps(job, pace);
  return phase_ != Phase::kDone;  // after a cancelled solve another job or reader may wait
}

void LiveSolver::take_over(const Inputs& inputs) {
  withdraw_better();
  absl::Status status;
  // Here a new p, or stiffness, reaches the solver.
  if (inputs.material != inputs_.material) status = deformer_->set_material(*inputs.material);
  const bool has_handles = !inputs.handles->handles().empty();
  if (status.ok() && has_handles && inputs.handles != held_) {
    status = mesh_->for_client(deformer_->set_handles(*inputs.handles));
    if (status.ok()) held_ = inputs.handles;
  }
  if (inputs.taken > inputs_.taken + 1) {
    publisher_.metrics().add(Count::kUpdatesCoalesced, static_cast<double>(inputs.taken - inputs_.taken - 1));
  }
  inputs_ = inputs;
  publisher_.begun(inputs.input_seq);
  blocked_ = has_handles ? status : no_handles();
  phase_ = blocked_.ok() ? Phase::kWaiting : Phase::kDone;
  was_begun_ = false;
  is_search_due_ = false;
  publisher_.set_standing(status.ok() ? std::nullopt
                                      : std::make_optional(FaultNote{status, inputs.input_seq}));
  if (!has_handles) publish(true);
}

/// Returns false if the job has ended.
bool LiveSolver::begin_job(SolveJob& job) {
  if (phase_ == Phase::kCertifying)
    phase_ = Phase::kAnswered;  // if begin_job() fails, the search begins again later
  absl::Status status = inputs_.handles == nullptr ? no_handles() : blocked_;
  const auto& initial = job.options().initial_positions;
  if (status.ok() && initial) status = check_positions(deformer_->shape(), *initial);
  if (!status.ok()) {  // what was announced still holds
    job.finish(status);
    return false;
  }
  withdraw_better();
  SolveSettings settings = inputs_.solver;
  settings.certify = job.options().certify;
  settings.keep_trace = job.options().keep_trace;
  if (initial) {
    settings.initial = InitialGuess::kCurrent;
    status = deformer_->set_positions(*initial);
  }
  if (status.ok()) status = deformer_->start(settings, job.stop_token());
  if (!status.ok()) job.finish(status);
  return status.ok();
}

/// Returns false if there is nothing to solve for.
bool LiveSolver::begin_live() {
  if (phase_ != Phase::kWaiting) return false;
  SolveSettings settings = inputs_.solver;
  if (was_begun_) settings.initial = InitialGuess::kCurrent;
  settings.effort = 0;
  const absl::Status status = deformer_->start(settings, stop_);
  if (status.ok()) return true;
  blocked_ = status;
  phase_ = Phase::kDone;
  publisher_.set_standing(FaultNote{status, inputs_.input_seq});
  return false;
}

void LiveSolver::pause() {
  phase_ = Phase::kWaiting;
  running_for_ = kNobody;
}

void LiveSolver::run_steps(SolveJob* job, const Pace& pace) {
  const bool is_first = job == nullptr && !is_refinement();
  const Clock::time_point end = Clock::now() + (is_first ? std::min(pace.slice, kFirstSlice) : pace.slice);
  bool has_more = true;
  do {
    has_more = deformer_->step();
  } while (has_more && Clock::now() < end && !is_outdated());
  if (!has_more) return end_solve(job);
  if (job != nullptr) report(*job);
  if (is_frame_due(pace)) publish(false);
}

/// A frame is due if it can be sent to a reader at once, or if the frame that waits for slow readers is old.
bool LiveSolver::is_frame_due(const Pace& pace) const {
  if (deformer_->is_certifying()) return false;  // the positions are those of the result
  const SolveSummary& summary = deformer_->summary();
  // From the first minimum on a solve searches, and the state stays as it is until it ends.
  if (is_refinement() && !summary.minima.empty() && summary.energy == shown_energy_) return false;
  if (is_refinement() && is_outdated()) return false;  // the frame of the newer inputs is next
  if (pace.is_sparing && is_refinement() && Clock::now() - last_published_ < kBetweenRefinements)
    return false;
  if (publisher_.is_frame_wanted(inputs_.taken)) return true;
  return publisher_.reader_count() > 0 && Clock::now() - last_published_ >= kOldestWaiting;
}

/// Whether the guess is shown before the first step. The frame after that step would be a refinement.
bool LiveSolver::is_guess_due(const Pace& pace) const {
  return deformer_->is_guess_smooth() && !is_refinement() && !pace.is_sparing && is_frame_due(pace);
}

void LiveSolver::end_solve(SolveJob* job) {
  if (deformer_->summary().stop_reason == StopReason::kCancelled) return pause();
  publisher_.metrics().observe(Span::kSolve, deformer_->summary().solve_seconds);
  publisher_.metrics().observe(Span::kSetup, deformer_->summary().setup_seconds);
  const bool is_certified = deformer_->summary().optimality_gap.has_value();
  phase_ = is_certified ? Phase::kDone : Phase::kAnswered;
  answered_at_ = alarm_.timers->now();
  is_alarm_set_ = false;
  if (!is_certified && publisher_.is_certificate_wanted()) set_alarm();
  running_for_ = kNobody;
  const StopReason reason = deformer_->summary().stop_reason;
  const bool is_minimum = reason == StopReason::kConverged || reason == StopReason::kStalled;
  is_search_due_ = false;
  if (is_minimum) plan_search();
  const std::shared_ptr<const Frame> frame = publish(true);
  if (job != nullptr) job->finish(SolveResult{deformer_->summary(), frame});
}

/// Searches for a certificate for the readers. Returns true while there is more to do.
bool LiveSolver::look_for_certificate() {
  if (!publisher_.is_certificate_wanted()) return false;
  if (phase_ == Phase::kAnswered && !begin_certificate()) return false;
  const Clock::time_point end = Clock::now() + kSlice;
  bool has_more = true;
  while (has_more && Clock::now() < end) has_more = deformer_->step();
  if (has_more) return true;
  phase_ = Phase::kDone;
  publisher_.certify_newest(deformer_->summary().optimality_gap.value());
  return is_search_due_;
}

/// Returns false if it is too early; then the alarm is set.
bool LiveSolver::begin_certificate() {
  if (alarm_.timers->now() < answered_at_ + kQuiet) {
    set_alarm();
    return false;
  }
  const bool is_begun = deformer_->start_certificate(stop_, kCertificateSeconds).ok();
  phase_ = is_begun ? Phase::kCertifying : Phase::kDone;
  return is_begun;
}

void LiveSolver::set_alarm() {
  if (!std::exchange(is_alarm_set_, true)) alarm_.timers->at(answered_at_ + kQuiet, alarm_.ring);
}

void LiveSolver::report(const SolveJob& job) {
  const Clock::time_point now = Clock::now();
  if (now - last_report_ < kBetweenReports) return;
  last_report_ = now;
  const SolveSummary& summary = deformer_->summary();
  job.report({static_cast<std::uint32_t>(summary.iterations), summary.energy, summary.solve_seconds});
}

std::shared_ptr<const Frame> LiveSolver::publish(bool is_final) {
  last_published_ = Clock::now();
  shown_version_ = inputs_.version;
  deformer_->catch_up();
  const SolveSummary& summary = deformer_->summary();
  shown_energy_ = summary.energy;
  Frame frame;
  frame.input_seq = inputs_.input_seq;
  frame.taken = inputs_.taken;
  frame.iteration = static_cast<std::uint32_t>(summary.iterations);
  frame.energy = summary.energy;
  frame.soft_energy = summary.soft_energy;
  frame.is_final = is_final;
  frame.stop_reason = is_final ? summary.stop_reason : StopReason::kRunning;
  frame.solve_seconds = summary.solve_seconds;
  frame.method = summary.method;
  if (is_final && blocked_.ok()) frame.optimality_gap = summary.optimality_gap;
  frame.surface = std::make_shared<const Surface>(mesh_->positions(deformer_->positions()),
                                                  mesh_->distortion(deformer_->cell_energies()), mesh_);
  return publisher_.publish(std::move(frame));
}

std::size_t LiveSolver::memory_bytes() const {
  return deformer_->memory_bytes() + publisher_.newest()->surface->memory_bytes();
}

}  // namespace lpdeform
