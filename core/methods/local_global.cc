#include "core/methods/local_global.h"

#include <cmath>

namespace lpdeform {

LocalGlobal::LocalGlobal(Problem problem, Points x) : problem_(std::move(problem)), x_(std::move(x)) {
  objective_ = problem_.objective.evaluate(x_, problem_.norm);
  is_factored_ = problem_.factor_metric(Metric::Precision::kDouble);
}

StepResult LocalGlobal::step() {
  if (!is_factored_) return {Outcome::kBreakdown, objective_, 0};
  problem_.objective.gradient(gradient_);
  restrict_to_free(problem_.constraints, gradient_);
  problem_.solve(gradient_, gradient_);
  x_ -= gradient_;
  const double before = objective_;
  objective_ = problem_.objective.evaluate(x_, problem_.norm);
  if (!std::isfinite(objective_)) return {Outcome::kBreakdown, objective_, 0};
  small_decreases_ = before - objective_ <= problem_.tolerance * objective_ ? small_decreases_ + 1 : 0;
  return {small_decreases_ >= 3 || objective_ == 0 ? Outcome::kConverged : Outcome::kProgress, objective_, 0};
}

}  // namespace lpdeform
