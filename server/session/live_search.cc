#include <algorithm>

#include "server/session/live_solver.h"

namespace lpdeform {

int LiveSolver::standing_effort() const {
  const SolveSettings& settings = inputs_.solver;
  const bool has_many_minima = settings.method == Method::kAuto && inputs_.material->p.minCoeff() < 2;
  return settings.effort.value_or(has_many_minima ? 1 : 0);
}

/// Decides whether and when there is a search next. The starts that the effort asks for follow one another at once. Before
/// those beyond them the pauses double: the longer a result has stood, the less likely is a lower one.
void LiveSolver::plan_search() {
  const int made = deformer_->summary().further_starts;
  const int wanted = Deformer::kStartsOfEffort * standing_effort();
  const bool has_more = made == 0 || (made < std::max(wanted, kMostStarts) && deformer_->has_other_starts());
  is_search_due_ = wanted > 0 && has_more && !stop_.stop_requested();
  if (!is_search_due_) return;
  const Timers::TimePoint now = alarm_.timers->now();
  search_from_ = std::max(now, answered_at_ + kSearchQuiet);
  if (made >= wanted)
    search_from_ = std::max(search_from_, now + kSearchQuiet * (1 << made / Deformer::kStartsOfEffort));
  if (search_from_ > now) postpone_search(search_from_);
}

/// Looks for minima lower than the result. Returns true while there is more to do now.
bool LiveSolver::look_for_better(const Pace& pace) {
  const Timers::TimePoint now = alarm_.timers->now();
  if (now < search_from_) return postpone_search(search_from_);
  if (pace.is_sparing || pace.slice < kSlice) return postpone_search(now + kQuiet);
  if (!deformer_->is_searching() && !begin_search()) return false;
  const Clock::time_point end = Clock::now() + kSlice;
  bool has_more = true;
  while (has_more && Clock::now() < end && !is_outdated()) has_more = deformer_->step();
  if (!has_more) end_search();
  return true;
}

/// Returns false if there is nothing to look for. If it goes on later, a search makes few starts, so that what it has found is
/// soon announced.
bool LiveSolver::begin_search() {
  if (phase_ == Phase::kCertifying) phase_ = Phase::kAnswered;  // start_search() ends the certificate
  const int effort = deformer_->has_other_starts() ? 1 : standing_effort();
  is_search_due_ = deformer_->start_search(effort, stop_).ok() && deformer_->is_searching();
  return is_search_due_;
}

/// One alarm is enough: where it rings too early, it is set again.
bool LiveSolver::postpone_search(Timers::TimePoint until) {
  if (search_alarm_ > alarm_.timers->now() && search_alarm_ <= until) return false;
  search_alarm_ = until;
  alarm_.timers->at(until, alarm_.ring);
  return false;
}

void LiveSolver::end_search() {
  plan_search();
  offer_better();
}

/// Announces or shows the lowest minimum found, if it saves enough.
void LiveSolver::offer_better() {
  const std::optional<double> energy = deformer_->better_energy();
  if (!energy) return;
  if (inputs_.solver.standing.shows) {
    publisher_.metrics().add(Count::kBetterShapes);
    return show_better();
  }
  const double saved_share = 1 - *energy / deformer_->summary().energy;
  if (!publisher_.announce({.input_seq = inputs_.input_seq, .energy = *energy, .saved_share = saved_share}))
    return;
  publisher_.metrics().add(Count::kBetterShapes);
  deformer_->reserve_better();  // even if a writer has taken it by now, it is shown after this
}

/// Called before the deformer loses the better shape, and when a writer has taken it. The writer was told that it is
/// taken, so that the state is replaced even if newer inputs or a solve are next.
void LiveSolver::withdraw_better() {
  if (publisher_.forget_better()) show_better();
}

void LiveSolver::show_better() {
  if (!deformer_->take_better()) return;
  phase_ = Phase::kAnswered;
  answered_at_ = alarm_.timers->now();
  is_alarm_set_ = false;
  if (publisher_.is_certificate_wanted()) set_alarm();
  publish(true);
}

}  // namespace lpdeform
