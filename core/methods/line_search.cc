#include "core/methods/line_search.h"

#include <cmath>

#include "core/problem/settings.h"

namespace lpdeform {

namespace {

constexpr double kRounding = 1e-15;  // relative, of a sum

}  // namespace

LineSearch::LineSearch(Problem problem, Points x) : problem_(std::move(problem)), x_(std::move(x)) {
  objective_ = problem_.objective.evaluate(x_, problem_.norm);
}

StepResult LineSearch::step() {
  if (!std::isfinite(objective_)) return {Outcome::kBreakdown, objective_, 0};
  if (problem_.is_zero(objective_)) return {Outcome::kConverged, objective_, 0};
  problem_.objective.gradient(gradient_);
  restrict_to_free(problem_.constraints, gradient_);
  // For positions in units of l, X = x / l, the gradient is l times gradient_, and a step in X is l times as long in x.
  const double squared_unit = problem_.length_unit * problem_.length_unit;
  const double squared_slope = squared_unit * gradient_.squaredNorm();
  if (squared_slope == 0) return {Outcome::kConverged, objective_, 0};
  if (!std::isfinite(squared_slope)) return {Outcome::kBreakdown, objective_, 0};

  double t = 1, value = 0;
  for (;; t *= kBeta) {
    if (problem_.stop.stop_requested()) break;
    trial_ = x_ - (t * squared_unit) * gradient_;
    value = problem_.objective.evaluate(trial_, problem_.norm);
    if (value <= objective_ - kAlpha * t * squared_slope) break;
    if (t * std::sqrt(squared_slope) < 1e-15) return {Outcome::kStalled, objective_, 0};
  }
  if (!(value <= objective_)) return {Outcome::kProgress, objective_, 0};  // stopped during the search
  const double full_step = std::sqrt(squared_slope / static_cast<double>(x_.rows()));
  const double threshold = kDisplacement * problem_.tolerance / SolveSettings::kDefaultTolerance;
  // If rounding hides the decrease, the short step says nothing about the distance to the minimum.
  const bool is_hidden = objective_ - value <= kRounding * objective_ && full_step >= threshold;
  x_.swap(trial_);
  objective_ = value;
  if (is_hidden) return {Outcome::kStalled, objective_, 0};
  return {t * full_step < threshold ? Outcome::kConverged : Outcome::kProgress, objective_, 0};
}

}  // namespace lpdeform
