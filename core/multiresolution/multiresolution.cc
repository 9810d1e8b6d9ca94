#include "core/multiresolution/multiresolution.h"

#include <algorithm>
#include <utility>

namespace lpdeform {
namespace {

constexpr double kCoarseTolerance = 1e-4;  // relative, of E^(1/p); the levels differ by more than this
constexpr double kRoughCoarseTolerance = 1e-3;  // where the first minimum is taken as it comes, and p is not 2

}  // namespace

Multiresolution::Multiresolution(Problem problem, Points x, CoarseLevel& level, int effort)
    : problem_(std::move(problem)), x_(std::move(x)), level_(level) {
  objective_ = problem_.objective.reweigh(problem_.norm);
  SolveSettings settings;
  settings.initial = InitialGuess::kLaplacian;
  const bool is_at_two = problem_.norm.lowest_p() == 2 && problem_.norm.highest_p() == 2;
  const double coarse = effort == 0 && !is_at_two ? kRoughCoarseTolerance : kCoarseTolerance;
  settings.tolerance = std::max(problem_.tolerance, coarse);
  settings.effort = effort;
  if (!level_.solver().start(settings, problem_.stop).ok())
    fine_ = std::make_unique<QuasiNewton>(problem_, x_, Warmth::kCold);
}

/// The prolonged result of the coarse level, moved to satisfy the constraints. Not always finite.
Points Multiresolution::prolonged() {
  Points found = level_.prolong(problem_.shape(), problem_.workers());
  for (Eigen::Index i = 0; i < found.rows(); ++i) {
    if (problem_.constraints.is_held[i]) found.row(i) = problem_.constraints.targets.row(i);
  }
  if (found.allFinite())
    problem_.constraints.linear.satisfy_within(problem_.metric, found, problem_.workers());
  if (found.allFinite()) even_out(found);
  return found;
}

/// Blended rigid motions leave kinks. One local/global step at p = 2 smooths them, with the metric of equal weights
/// that the guess was made with.
void Multiresolution::even_out(Points& found) const {
  const LpNorm even(Material::uniform(2), problem_.shape().vertex_count(), 1, 1);
  Points step;
  problem_.objective.evaluate(found, even);
  problem_.objective.gradient(step);
  restrict_to_free(problem_.constraints, step);
  problem_.precondition(step, step);
  found -= step;
}

std::optional<Points> Multiresolution::intermediate_state() {
  if (fine_) return std::nullopt;
  const int done = level_.solver().iterations();
  if (done < next_look_) return std::nullopt;
  next_look_ = 2 * done;
  level_.solver().catch_up();
  Points found = prolonged();
  if (!found.allFinite()) return std::nullopt;
  problem_.objective.evaluate(found, problem_.norm);
  return found;
}

/// Starts QuasiNewton from the better of the guess and the result of the coarse level.
void Multiresolution::begin_fine() {
  Points found = prolonged();
  level_.leave();
  const bool is_better = found.allFinite() && problem_.objective.evaluate(found, problem_.norm) < objective_;
  if (is_better) {
    x_.swap(found);
  } else {
    problem_.objective.evaluate(x_, problem_.norm);
  }
  fine_ =
      std::make_unique<QuasiNewton>(problem_, std::move(x_), is_better ? Warmth::kPrepared : Warmth::kCold);
}

StepResult Multiresolution::step() {
  if (fine_) {
    StepResult result = fine_->step();
    ++result.stage;  // stage 0 is the coarse level
    return result;
  }
  if (level_.solver().step()) return {Outcome::kProgress, objective_, 0, objective_};
  begin_fine();
  const double sum = problem_.objective.sum(problem_.norm);
  return {Outcome::kProgress, sum, 0, sum};
}

}  // namespace lpdeform
