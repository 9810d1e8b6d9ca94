#include "core/multiresolution/multiresolution.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "core/methods/kinks.h"

namespace lpdeform {
namespace {

// Relative tolerances of E^(1/p) on the coarse level.
constexpr double kCoarseTolerance = 1e-4;       // the levels differ by more than this
constexpr double kRoughCoarseTolerance = 1e-3;  // if some p_i < 2 and the first minimum is taken as it comes
constexpr double kFirstTolerance = 1e-2;        // before its cells bend like the fine ones
constexpr double kEasedTolerance = 3e-3;        // after that
constexpr double kGentleTolerance = 1e-2;       // if its cells bend like the fine ones from the beginning
constexpr double kLowestTolerance = 1e-4;       // on the lowest level of those, once they do

/// Handles have moved little if no cell of the guess is strained more than this. Sheets that are bent by 0.036 have been seen to end
/// in worse minima when all levels bend like the finest.
constexpr double kGentleStrain = 0.02;

/// Fine iterations before an early graded level, if no p_i is above 2. They take the kinks of the prolongation away, and often they are
/// all that is needed. At a larger p the graded level comes first.
constexpr int kFirstFine = 10;
/// Relative tolerances of E^(1/p) on the graded level.
constexpr double kGradedTolerance = 1e-3;
constexpr double kGradedToleranceAtLargeP =
    3e-3;  // if some p_i > 2: iterations are dear, because it is larger
constexpr double kLateTolerance = 1e-4;
/// Every kReckon fine iterations, k since another level ended, what is left to do is reckoned: k times the mean relative fall of E^(1/p)
/// in one of the last kReckon iterations. If E^(1/p) falls towards its limit as 1 / k, this is about what is left. From kFirstOfLate
/// iterations on, a late graded level begins if it is over kMostLeft.
constexpr int kReckon = 20, kFirstOfLate = 40;
constexpr double kMostLeft = 0.03;
/// E^(1/p) with which the fine level goes on from the graded one, over that before: the first iterations take kinks away.
constexpr double kMostAfterGraded = 1.1;

constexpr int kSweeps = 3;  // of relax(), where the fine surface has moved along with the graded level

constexpr int kCostOfLook = 5;  // looking at the coarse level takes at most one part in this many of the time

}  // namespace

Multiresolution::Multiresolution(Problem problem, Points x, CoarseLevel& level, int effort,
                                 std::optional<Grading> grading)
    : problem_(std::move(problem)),
      x_(std::move(x)),
      level_(level),
      is_search_(effort != 0),
      grading_(std::move(grading)) {
  objective_ = problem_.objective.reweigh(problem_.norm);
  SolveSettings settings;
  settings.initial = InitialGuess::kLaplacian;
  if (level_.can_bend_like_fine() && level_.has_level_below() && !is_search_ && is_gentle()) {
    is_eased_ = true;
    grading_.reset();
    level_.bend_like_fine();
  }
  settings.tolerance = std::max(problem_.tolerance, first_tolerance());
  settings.effort = effort;
  if (level_.solver().start(settings, problem_.stop).ok()) return;
  grading_.reset();
  fine_ = std::make_unique<QuasiNewton>(problem_, x_, Warmth::kCold);
}

/// Whether the handles have moved little: E_i^2 <= kGentleStrain^2 sum_j w_ij |p_i - p_j|^2 in every cell of the guess.
bool Multiresolution::is_gentle() const {
  const RestShape& shape = problem_.shape();
  const Points& rest = shape.scaled_positions();
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    double size = 0;
    for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k)
      size += shape.weights()[k] * (rest.row(i) - rest.row(shape.neighbours()[k])).squaredNorm();
    if (!(problem_.objective.cells().squared_energies()[i] <= kGentleStrain * kGentleStrain * size))
      return false;
  }
  return true;
}

double Multiresolution::first_tolerance() const {
  if (is_eased_) return kGentleTolerance;
  if (is_search_) return kCoarseTolerance;
  if (level_.can_bend_like_fine()) return kFirstTolerance;
  return problem_.norm.lowest_p() < 2 ? kRoughCoarseTolerance : kCoarseTolerance;
}

/// The prolonged result of the coarse level, moved to satisfy the constraints. Not always finite.
Points Multiresolution::prolonged() {
  Points found = level_.prolong(problem_.shape(), problem_.workers());
  make_feasible(found);
  if (found.allFinite()) even_out(found);
  return found;
}

/// Moves a state to satisfy the constraints. Not always finite.
void Multiresolution::make_feasible(Points& found) const {
  for (Eigen::Index i = 0; i < found.rows(); ++i) {
    if (problem_.constraints.is_held[i]) found.row(i) = problem_.constraints.targets.row(i);
  }
  if (found.allFinite())
    problem_.constraints.linear.satisfy_within(problem_.metric, found, problem_.workers());
}

/// Blended rigid motions leave kinks. One local/global step at p = 2 smooths them: the metric is that of equal weights, with which the
/// guess was made.
void Multiresolution::even_out(Points& found) const {
  Points step;
  problem_.objective.evaluate(found, even_norm());
  problem_.objective.gradient(step);
  restrict_to_free(problem_.constraints, step);
  problem_.precondition(step, step);
  found -= step;
}

LpNorm Multiresolution::even_norm() const {
  return LpNorm(Material::uniform(2), problem_.shape().vertex_count(), 1, 1);
}

std::optional<Points> Multiresolution::intermediate_state(bool is_last) {
  if (fine_) return std::nullopt;
  LevelSolver& solver = graded_ ? graded_->solver() : level_.solver();
  const int done = solver.iterations();
  const auto begun = std::chrono::steady_clock::now();
  const bool is_due = done != looked_at_ && begun >= next_look_;
  if ((done < kFirstLook && !goes_on_) || !(is_due || is_last)) return std::nullopt;
  looked_at_ = done;
  solver.catch_up(is_last);
  Points found = graded_ ? moved_with_graded() : prolonged();
  const bool is_good = found.allFinite();
  if (is_good) problem_.objective.evaluate(found, problem_.norm);
  const auto now = std::chrono::steady_clock::now();
  next_look_ = now + (kCostOfLook - 1) * (now - begun);
  return is_good ? std::make_optional(std::move(found)) : std::nullopt;
}

/// Lets the coarse level go on from its result with cells that bend like the fine ones. False if it does not.
bool Multiresolution::begin_to_ease() {
  if (is_eased_ || !level_.can_bend_like_fine()) return false;
  is_eased_ = goes_on_ = true;
  level_.bend_like_fine();
  SolveSettings settings;
  settings.initial = InitialGuess::kCurrent;
  settings.method = Method::kQuasiNewton;
  // Where the fine level has easy bends itself, its tolerance is kGentleTolerance. At p > 2 this level could end on a plateau with it.
  const bool is_tight = level_.is_fine_eased() && problem_.norm.highest_p() > 2;
  const double eased = is_tight ? kEasedTolerance : std::max(problem_.tolerance, kEasedTolerance);
  settings.tolerance = level_.has_level_below() ? eased : kLowestTolerance;
  settings.effort = 0;
  return level_.solver().start(settings, problem_.stop).ok();
}

/// The vertices of the graded level, if there is to be one at the last evaluation's state. Otherwise empty, and there is no early one
/// later, or none at all.
std::vector<char> Multiresolution::chosen_for_graded() {
  std::vector<char> stays;
  if (!grading_) return stays;
  stays =
      GradedLevel::chosen(level_, problem_.objective.cells().squared_energies(), problem_.norm.highest_p());
  if (stays.empty()) end_grading();
  return stays;
}

/// No early graded level is to come any more, or none at all.
void Multiresolution::end_grading() {
  const bool may_come_late = grading_->is_early && grading_->may_come_late;
  grading_->is_early = false;
  if (!may_come_late) grading_.reset();
}

/// With what the fine level goes on from where it was. After the first iterations its smoothing begins with the small eps of a warm start.
Warmth Multiresolution::warmth_of_fine() const {
  return fine_iterations_ > kFirstFine ? Warmth::kWarm : Warmth::kPrepared;
}

/// Begins a graded level from x, the last evaluation's state. False if there is to be none.
bool Multiresolution::begin_graded(const std::vector<char>& stays) {
  if (stays.empty()) return false;
  const bool is_early = grading_->is_early;
  objective_ = problem_.objective.sum(problem_.norm);
  // Where some p_i > 2, the level is large. The fine level's factor is freed for it, and made again for other weights afterwards anyway.
  const bool has_large_p = problem_.norm.highest_p() > 2;
  if (has_large_p && problem_.constraints.linear.empty()) problem_.metric.release();
  const FineInputs inputs{problem_.shape(), grading_->handles, problem_.constraints, grading_->material, 1};
  graded_ = GradedLevel::create(inputs, x_, stays, grading_->make_solver, problem_.stop);
  end_grading();
  looked_at_ = 0;
  const double tolerance = !is_early                       ? kLateTolerance
                           : problem_.norm.highest_p() > 2 ? kGradedToleranceAtLargeP
                                                           : kGradedTolerance;
  if (graded_ && graded_->start(std::max(problem_.tolerance, tolerance), problem_.stop).ok()) return true;
  graded_.reset();
  return false;
}

/// Whether a graded level is to come now, an early or a late one. At p > 2, where the distortion is spread widely, there is no late one.
/// To be called once before each fine iteration.
bool Multiresolution::is_time_for_graded() {
  if (!grading_) return false;
  if (grading_->is_early) return fine_iterations_ == kFirstFine;
  const double p = problem_.norm.highest_p();
  if (p > 2 || since_level_ == 0 || since_level_ % kReckon != 0) return false;
  const double before = std::exchange(reckoned_sum_, sum_);
  const double fall = (1 - std::pow(sum_ / before, 1 / p)) / kReckon;
  return since_level_ >= kFirstOfLate && since_level_ * fall > kMostLeft;
}

/// Lets a graded level go on from the fine state, if there is to be one.
void Multiresolution::leave_fine() {
  const std::vector<char> stays = chosen_for_graded();
  if (stays.empty()) return;
  x_ = fine_->x();
  fine_.reset();  // it would take memory beside the graded level
  stages_before_ = stage_ + 1;
  if (!begin_graded(stays)) fine_ = std::make_unique<QuasiNewton>(problem_, std::move(x_), warmth_of_fine());
}

/// x, moved along with the graded level, and evened out if that lowers its energy. Not always finite. Where some p_i > 2, cell weights
/// differ too much, and sweeps have equal ones.
Points Multiresolution::moved_with_graded() const {
  Points found = graded_->moved(problem_.shape(), x_, problem_.workers());
  make_feasible(found);
  if (!found.allFinite()) return found;
  const double objective = problem_.objective.evaluate(found, problem_.norm);
  Points even = found;
  relax(problem_, problem_.norm.highest_p() > 2 ? even_norm() : problem_.norm, kSweeps, even);
  if (even.allFinite() && problem_.objective.evaluate(even, problem_.norm) < objective) return even;
  return found;
}

/// The fine level goes on from the result of the graded level, unless that is much worse than where it was.
void Multiresolution::end_graded() {
  const bool has_moved = graded_->solver().iterations() > 0;
  Points found = has_moved ? moved_with_graded() : x_;
  graded_.reset();
  const double most = std::pow(kMostAfterGraded, problem_.norm.lowest_p()) * objective_;
  const bool is_good =
      has_moved && found.allFinite() && problem_.objective.evaluate(found, problem_.norm) < most;
  if (is_good)
    x_.swap(found);
  else
    problem_.objective.evaluate(x_, problem_.norm);
  found.resize(0, 3);
  since_level_ = 0;
  stage_ = stages_before_++;  // the objective may be higher than while the level ran
  fine_ = std::make_unique<QuasiNewton>(problem_, std::move(x_), is_good ? Warmth::kWarm : warmth_of_fine());
}

/// Goes on from the better of the guess and the result of the coarse level: on the graded level, if that comes first, or on the fine one.
void Multiresolution::end_coarse() {
  Points found = prolonged();
  const bool is_better = found.allFinite() && problem_.objective.evaluate(found, problem_.norm) < objective_;
  if (is_better) {
    x_.swap(found);
    ease_kinks(problem_, x_);
  } else {
    problem_.objective.evaluate(x_, problem_.norm);
  }
  if (!is_better) grading_.reset();
  const bool comes_first = grading_ && grading_->is_early && problem_.norm.highest_p() > 2;
  if (comes_first && begin_graded(chosen_for_graded())) return;
  fine_ =
      std::make_unique<QuasiNewton>(problem_, std::move(x_), is_better ? Warmth::kPrepared : Warmth::kCold);
}

StepResult Multiresolution::step() {
  if (fine_ && is_time_for_graded()) leave_fine();
  if (fine_) {
    StepResult result = fine_->step();
    ++fine_iterations_, ++since_level_;
    sum_ = *result.true_sum;
    stage_ = result.stage += stages_before_;
    return result;
  }
  const StepResult waiting{Outcome::kProgress, objective_, stage_, objective_};
  if (graded_) {
    if (graded_->solver().step()) return waiting;
    end_graded();
  } else {
    if (level_.solver().step()) return waiting;
    if (is_search_ && !is_eased_ && !level_.solver().has_found_lower())
      return {Outcome::kBreakdown, objective_, 0, objective_};
    if (begin_to_ease()) return waiting;
    end_coarse();
  }
  const double sum = problem_.objective.sum(problem_.norm);
  return {Outcome::kProgress, sum, stage_, sum};
}

}  // namespace lpdeform
