#include "core/methods/quasi_newton.h"

#include <algorithm>
#include <cmath>

namespace lpdeform {
namespace {

// f is the stage's objective, g its gradient, d the direction, t the step's length; f_k is f after k iterations of the stage.

/// Pairs (s, y) that the direction is made of.
constexpr std::size_t kMemory = 6;
constexpr std::size_t kChunk = 4096;  // vertices

/// The search along d accepts t where f(x + t d) <= f(x) + kSufficientDecrease t <g, d> .
constexpr double kSufficientDecrease = 1e-4;

/// The last stage has converged where f_(k - kWindow) - f_k <= tolerance p f_k , p the largest p_i.
constexpr int kWindow = 20;
/// Any other stage ends where f_(k - kWindow) - f_k <= kStageTolerance tolerance p f_k , or k >= kStageIterations .
constexpr double kStageTolerance = 30;
constexpr int kStageIterations = 60;
/// At tolerances >= kRough , which most coarse levels have, a stage of smoothing may end sooner, from k = kRoughWindow on. As long as
/// k < kWindow , the condition has f_0 in place of f_(k - kWindow) .
constexpr double kRough = 2e-3;
constexpr int kRoughWindow = 5;

/// The metric is refactored where r >= kRefresh , r the iterations since it was; or where t < kShortStep and r >= kSoonest .
constexpr int kRefresh = 40, kSoonest = 2;
constexpr double kShortStep = 0.9;
/// A live session begins with r = kRefresh - kTrial : it keeps the metric that it finds for kTrial iterations or for a stage.
constexpr int kTrial = 10;

/// If the lowest p_i < kKinkedP and no p_i > 2, the first stage of a live session also ends where k >= kTrial and
/// f_(k - kLittleWindow) - f_k <= kLittle (f_k - F_k) , F the objective without smoothing. The metric is refactored then either way.
constexpr int kLittleWindow = 5;
constexpr double kLittle = 0.01, kKinkedP = 1.1;

/// From one stage of smoothing to the next, eps^2 becomes kSmoothingStep eps^2 .
constexpr double kSmoothingStep = 0.1;
/// eps^2 over the squared diagonal, of the first: after a plain guess, and after a coarse level.
constexpr double kColdSmoothing = 1e-8, kPreparedSmoothing = 1e-9;
/// After a coarse level eps is at most kMostSmoothing mean E_i , which decides where the handles have moved little.
constexpr double kMostSmoothing = 30;
/// A live session's first eps adds a tenth to the mean cell: eps^p = kLiveBias (mean E_i)^p , p the lowest p_i.
constexpr double kLiveBias = 0.1;
/// Smoothing has ended where eps^2 <= kLeastSmoothing diagonal^2 (rounding),
constexpr double kLeastSmoothing = 1e-26;
/// or where sum over p_i < 2 of eps^p_i <= b sum_i E_i^p_i , b the tolerance, but at least kBias and at most kLeastBias.
constexpr double kBias = 3e-4;
/// What was minimised is the true objective F where f - F <= kLeastBias F . Else the solve has stalled, not converged.
constexpr double kLeastBias = 0.01;

/// If the lowest p_i >= 2, solves go by way of p = kMiddleP: a cold one where the largest p_i > kLargeP , and for at most
/// kEveningIterations after a coarse level where the largest p_i > kMiddleP .
constexpr double kMiddleP = 4, kLargeP = 12;
constexpr int kEveningIterations = 20;

}  // namespace

QuasiNewton::QuasiNewton(Problem problem, Points x, Warmth warmth)
    : problem_(std::move(problem)),
      norm_(problem_.norm),
      x_(std::move(x)),
      memory_(problem_.objective.cells().workers(), kMemory),
      is_prepared_(warmth == Warmth::kPrepared),
      keeps_metric_(warmth == Warmth::kWithMetric) {
  const double lowest = problem_.norm.lowest_p();
  if (lowest < 2) eps2_ = first_smoothing(warmth, lowest);
  // If all p_i > 2, there is no continuation from p = 2: it leads into worse minima (a bent cactus at p = 6 ends at 1.8
  // times the E^(1/p)).
  for (const double p : {2.0, 1.6, 1.35, 1.2, 1.1, 1.05}) {
    if (warmth == Warmth::kCold && p > lowest) shares_.push_back((2 - p) / (2 - lowest));
  }
  // Without the stage at p = 4, a bent grid at p = 24 ends at 1.9 times the E^(1/p). After a coarse level, what the
  // prolongation has left in a few cells outweighs the rest of the surface at a large p.
  const double highest = problem_.norm.highest_p();
  if (lowest >= 2 && ((warmth == Warmth::kCold && highest > kLargeP) || (is_prepared_ && highest > kMiddleP)))
    shares_.push_back((kMiddleP - 2) / (highest - 2));
  begin_stage(warmth == Warmth::kWithMetric);
  true_sum_ = problem_.objective.sum(problem_.norm);
}

/// Sets up the objective of stage_: early stages change p, later ones eps. problem_.objective holds the evaluation at
/// x_.
void QuasiNewton::begin_stage(bool keeps_metric) {
  const bool is_on_the_way = stage_ < static_cast<int>(shares_.size());
  if (stage_ > static_cast<int>(shares_.size())) eps2_ *= kSmoothingStep;
  norm_ = (is_on_the_way ? problem_.norm.nearer_two(shares_[stage_]) : problem_.norm).smoothed(eps2_);
  is_true_norm_ = !is_on_the_way && eps2_ == 0;
  objective_ = problem_.objective.reweigh(norm_);
  is_last_stage_ = !is_on_the_way && is_smooth_enough();
  smoothing_sum_ = is_last_stage_ && norm_.lowest_p() < norm_.highest_p() ? smoothing_sum() : 0;
  history_.assign(1, objective_);
  stage_iterations_ = 0;
  find_gradient();
  forget();
  is_metric_good_ = keeps_metric ? adopt_metric() : refresh_metric();
}

double QuasiNewton::mean_energy() const {
  double sum = 0;
  for (const double e2 : problem_.objective.cells().squared_energies()) sum += std::sqrt(e2);
  return sum / static_cast<double>(problem_.shape().cell_count());
}

/// The first eps^2. In a live session it follows from the cells' energies. After a cold guess these are far too large,
/// so the diagonal decides.
double QuasiNewton::first_smoothing(Warmth warmth, double lowest_p) const {
  const double diagonal2 = problem_.diagonal * problem_.diagonal;
  if (warmth == Warmth::kCold) return kColdSmoothing * diagonal2;
  if (warmth == Warmth::kPrepared) {
    const double most = kMostSmoothing * mean_energy();
    return std::max(std::min(kPreparedSmoothing * diagonal2, most * most), kLeastSmoothing * diagonal2);
  }
  const double eps = std::pow(kLiveBias, 1 / lowest_p) * mean_energy();
  return std::max(eps * eps, kLeastSmoothing * diagonal2);
}

/// The sum that smoothing gives to undistorted cells with p_i < 2: an upper bound of what smoothing adds to the
/// objective.
double QuasiNewton::smoothing_sum() const {
  if (problem_.norm.lowest_p() >= 2) return 0;
  if (problem_.norm.is_uniform()) return problem_.shape().cell_count() * problem_.norm.term(0, eps2_).value;
  const auto& offsets = problem_.shape().offsets();
  double sum = 0;
  for (std::int32_t i = 0; i < problem_.shape().vertex_count(); ++i) {
    if (problem_.norm.p(i) < 2 && offsets[i + 1] > offsets[i]) sum += problem_.norm.term(i, eps2_).value;
  }
  return sum;
}

/// Whether eps is small enough: smoothing adds at most eps^p to E_i^p of a cell with p_i < 2, and this is negligible
/// compared with the sum, or a smaller eps would be lost in rounding.
bool QuasiNewton::is_smooth_enough() const {
  if (eps2_ <= kLeastSmoothing * problem_.diagonal * problem_.diagonal) return true;
  const double bias = std::clamp(problem_.tolerance, kBias, kLeastBias);
  return smoothing_sum() <= bias * problem_.objective.sum(problem_.norm);
}

/// Whether the last stage has minimised the true objective, except for a small share that smoothing adds.
bool QuasiNewton::is_end_true() const {
  const double sum = problem_.objective.sum(problem_.norm);
  return is_true_norm_ || objective_ - sum <= kLeastBias * sum;
}

/// The cell weights c_i. Weights of cells with p_i > 2 are raised to the mean of such cells if they are below it.
std::vector<double> QuasiNewton::metric_weights() const {
  std::vector<double> weights = problem_.objective.cells().cell_weights();
  if (norm_.highest_p() <= 2) return weights;
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (norm_.p(static_cast<std::int32_t>(i)) > 2) sum += weights[i], ++count;
  }
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (norm_.p(static_cast<std::int32_t>(i)) > 2) weights[i] = std::max(weights[i], sum / count);
  }
  return weights;
}

/// In a live session the previous metric is used at first, because a factorisation takes as long as several iterations.
bool QuasiNewton::adopt_metric() {
  since_refresh_ = kRefresh - kTrial;
  problem_.metric.adopt(metric_weights());
  return true;
}

void QuasiNewton::find_gradient() {
  problem_.objective.gradient(gradient_);
  restrict_to_free(problem_.constraints, gradient_);
}

/// Drops all pairs, including the pending pair of the last step.
void QuasiNewton::forget() {
  memory_.clear();
  step_length_ = 0;
}

/// Refactors the metric for the current weights. The last step's pair is kept, in the new metric. If the metric has not
/// changed, all pairs are kept.
bool QuasiNewton::refresh_metric() {
  since_refresh_ = 0;
  const auto version = problem_.metric.version();
  const double scale = problem_.metric.scale();
  if (!problem_.factor_metric(metric_weights(), Metric::Precision::kSingle)) return false;
  if (problem_.metric.version() == version && problem_.metric.scale() == scale) return true;
  memory_.clear();
  if (step_length_ == 0) return true;
  problem_.precondition(trial_, preconditioned_);
  memory_.set_before(preconditioned_);
  return true;
}

/// d = -H g with the H_0 of LbfgsMemory. Returns <g, d>.
double QuasiNewton::direction() {
  problem_.precondition(gradient_, preconditioned_);
  const double slope = memory_.direction(gradient_, trial_, preconditioned_, step_length_, direction_);
  problem_.constraints.linear.restrict(direction_);  // pairs are kept in single precision
  step_length_ = 0;
  return slope;
}

/// trial_ = x + t * direction.
void QuasiNewton::go_along(double t) {
  trial_.resize(x_.rows(), 3);
  problem_.workers().for_chunks(
      static_cast<std::size_t>(x_.rows()), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
        const auto first = static_cast<Eigen::Index>(begin), count = static_cast<Eigen::Index>(end - begin);
        trial_.middleRows(first, count) =
            x_.middleRows(first, count) + t * direction_.middleRows(first, count);
      });
}

/// The step length along direction_; 0 if none is found. Afterwards problem_.objective holds the evaluation at trial_.
double QuasiNewton::search(double slope) {
  double t = 1;
  for (int trial = 0; trial < 40 && !problem_.stop.stop_requested(); ++trial) {
    go_along(t);
    const double value = problem_.objective.evaluate(trial_, norm_);
    if (value <= objective_ + kSufficientDecrease * t * slope) {
      objective_ = value;
      return t;
    }
    // The minimiser of the parabola through f(0), f'(0), f(t), clamped to [t / 10, t / 2].
    const double parabola =
        std::isfinite(value) ? -0.5 * slope * t * t / (value - objective_ - slope * t) : 0;
    t = std::clamp(parabola, 0.1 * t, 0.5 * t);
  }
  return 0;
}

/// Whether the first stage of a live session can end, because the last iterations have gained little compared with what smoothing adds.
/// To be called at the start of a step, where true_sum_ is that of x_.
bool QuasiNewton::is_smoothing_in_the_way() const {
  const bool may_end = keeps_metric_ && stage_ == 0 && stage_iterations_ >= kTrial;
  if (!may_end || problem_.norm.lowest_p() >= kKinkedP || problem_.norm.highest_p() > 2) return false;
  return history_[history_.size() - 1 - kLittleWindow] - objective_ <= kLittle * (objective_ - true_sum_);
}

bool QuasiNewton::is_stage_over() const {
  const bool is_smoothing = !is_last_stage_ && stage_ >= static_cast<int>(shares_.size());
  if (is_smoothing && is_smoothing_in_the_way()) return true;
  const int window = is_smoothing && problem_.tolerance >= kRough ? kRoughWindow : kWindow;
  if (static_cast<int>(history_.size()) <= window) return false;
  const double tolerance = (is_last_stage_ ? 1 : kStageTolerance) * problem_.tolerance;
  const double to_lower = std::max(0.0, history_.back() - smoothing_sum_);
  return history_.front() - history_.back() <= tolerance * norm_.highest_p() * to_lower;
}

/// problem_.objective holds the evaluation at x_.
StepResult QuasiNewton::result(Outcome outcome) {
  true_sum_ = is_true_norm_ ? objective_ : problem_.objective.sum(problem_.norm);
  return {outcome, objective_, stage_, true_sum_};
}

/// Called when no step along d decreases the objective: continues with a fresh metric without memory, with the next
/// stage, or ends.
StepResult QuasiNewton::give_up(double slope) {
  problem_.objective.evaluate(x_, norm_);
  if (problem_.stop.stop_requested()) return result(Outcome::kProgress);
  if (since_refresh_ > 0 || !memory_.is_empty()) {
    forget();
    is_metric_good_ = refresh_metric();
    return result(Outcome::kProgress);
  }
  if (!is_last_stage_ || !is_smooth_enough()) {
    ++stage_;
    begin_stage();
    return result(Outcome::kProgress);
  }
  const bool is_good =
      slope <= 0 && -0.5 * slope <= problem_.tolerance * norm_.highest_p() * objective_ && is_end_true();
  return result(is_good ? Outcome::kConverged : Outcome::kStalled);
}

void QuasiNewton::accept(double length) {
  x_.swap(trial_);
  gradient_.swap(trial_);
  find_gradient();
  step_length_ = last_length_ = length;
  ++stage_iterations_, ++since_refresh_;
  history_.push_back(objective_);
  if (history_.size() > kWindow + 1) history_.pop_front();
}

StepResult QuasiNewton::step() {
  if (problem_.is_zero(true_sum_)) return result(Outcome::kConverged);
  const bool is_evening = is_prepared_ && stage_ < static_cast<int>(shares_.size());
  const int most = is_evening ? kEveningIterations : kStageIterations;
  if (!is_last_stage_ && (stage_iterations_ >= most || is_stage_over())) {
    ++stage_;
    begin_stage();
  } else if (since_refresh_ >= kRefresh || (last_length_ < kShortStep && since_refresh_ >= kSoonest)) {
    is_metric_good_ = refresh_metric();
  }
  if (!is_metric_good_ || !std::isfinite(objective_)) return result(Outcome::kBreakdown);

  const double slope = direction();
  const double length = slope < 0 ? search(slope) : 0;
  if (length == 0) return give_up(slope);
  accept(length);
  if (is_last_stage_ && is_stage_over()) {
    if (is_smooth_enough()) return result(is_end_true() ? Outcome::kConverged : Outcome::kStalled);
    is_last_stage_ = false;  // the energies have decreased so much that eps matters again
  }
  return result(Outcome::kProgress);
}

}  // namespace lpdeform
