#include "core/methods/conic.h"

#include <cmath>

#include "core/problem/settings.h"

namespace lpdeform {

Conic::Conic(Problem problem, Points x) : problem_(std::move(problem)), x_(std::move(x)) {
  begin_stage();
}

void Conic::begin_stage() {
  ++stage_;
  stage_start_ = x_;
  objective_ = problem_.objective.evaluate(x_, problem_.norm);
  cone_.emplace(problem_, problem_.objective.cells().rotations(), x_);
  gap_ = cone_->relative_gap();
  since_lower_ = 0;
}

bool Conic::gets_further() {
  if (cone_->relative_gap() < 0.99 * gap_) {
    gap_ = cone_->relative_gap();
    since_lower_ = 0;
  }
  return since_lower_++ < kPatience;
}

StepResult Conic::end_stage() {
  const double displacement = (x_ - stage_start_).norm() / std::sqrt(static_cast<double>(x_.rows()));
  const double threshold =
      kDisplacement * problem_.length_unit * problem_.tolerance / SolveSettings::kDefaultTolerance;
  const StepResult result{displacement < threshold ? Outcome::kConverged : Outcome::kProgress, objective_,
                          stage_};
  if (result.outcome == Outcome::kProgress) begin_stage();
  return result;
}

StepResult Conic::step() {
  const bool is_solved = cone_->relative_gap() <= kGap;
  const bool is_able = is_solved || cone_->iterate();
  if (cone_->primal() < objective_) {
    objective_ = cone_->primal();
    x_ = cone_->x();
    problem_.objective.evaluate(x_, problem_.norm);
  }
  if (is_solved || cone_->relative_gap() <= kGap) return end_stage();
  if (is_able && gets_further()) return {Outcome::kProgress, objective_, stage_};
  return cone_->relative_gap() <= kAcceptableGap ? end_stage()
                                                 : StepResult{Outcome::kBreakdown, objective_, stage_};
}

}  // namespace lpdeform
