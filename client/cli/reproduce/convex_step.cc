#include "client/cli/reproduce/convex_step.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "core/certificate/certificate.h"

namespace lpdeform::reproduce {
namespace {

constexpr int kMostIterations = 400, kMostBacktracks = 40;
constexpr double kSufficientDecrease = 0.3, kShortening = 0.5;  // the paper's alpha and beta
constexpr double kEnough = 1e-9;  // of the energy: a step that promises no more than this ends the descent
constexpr double kFirstSmoothing = 1;  // eps^2 for p < 2, in mean edge lengths squared
constexpr double kLastSmoothing = 1e-12, kSmoothingStep = 0.1;
constexpr double kShake = 0.1;  // share of the diagonal
constexpr double kTolerance = 1e-5;

/// The state of a descent with fixed rotations. Positions are in scaled units.
class HeldRotations {
 public:
  HeldRotations(std::shared_ptr<const RestShape> shape, Constraints constraints, Metric metric, double p)
      : shape_(std::move(shape)),
        constraints_(std::move(constraints)),
        metric_(std::move(metric)),
        objective_(shape_, Workers(1)),
        norm_(Material::uniform(p), shape_->vertex_count(), shape_->mean_edge_length(), 1) {}

  /// The naive Laplacian deformation, whose rotations are held from here on. nullopt if the metric cannot be
  /// factored.
  std::optional<Points> begin();
  Points rest() const { return constraints_.targets; }
  Points shaken(Points x, std::mt19937& random) const;

  /// The positions where a descent from `x` ends.
  Points lowest_from(Points x, std::stop_token stop);
  /// E^(1/p) in the caller's unit.
  double length(const Points& x);
  /// The relative gap of the energy: see relative_gap.
  double gap(const Points& x, std::stop_token stop);

 private:
  bool descend(Points& x, const LpNorm& norm);

  std::shared_ptr<const RestShape> shape_;
  Constraints constraints_;
  Metric metric_;
  Objective objective_;
  LpNorm norm_;
};

std::optional<Points> HeldRotations::begin() {
  const std::vector<double> equal(static_cast<std::size_t>(shape_->vertex_count()), 1.0);
  if (!metric_.factor(equal, constraints_.is_held, {}, Workers(1))) return std::nullopt;
  Points moved = constraints_.targets - shape_->scaled_positions();
  metric_.extend(constraints_.is_held, moved, Workers(1));
  moved += shape_->scaled_positions();
  objective_.evaluate(moved, norm_);
  return moved;
}

Points HeldRotations::shaken(Points x, std::mt19937& random) const {
  std::normal_distribution<double> normal(0, kShake * shape_->diagonal() / shape_->mean_edge_length());
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (constraints_.is_held[i]) continue;
    for (double& coordinate : x.row(i)) coordinate += normal(random);
  }
  return x;
}

/// One step. Returns false if there is nothing more to gain.
bool HeldRotations::descend(Points& x, const LpNorm& norm) {
  const double value = objective_.evaluate_held(x, norm);
  Points gradient, direction;
  objective_.gradient(gradient);
  restrict_to_free(constraints_, gradient);
  if (!metric_.factor(objective_.cells().cell_weights(), constraints_.is_held, {}, Workers(1))) return false;
  metric_.solve(gradient, direction, Workers(1));
  const double slope = gradient.cwiseProduct(direction).sum();
  if (!(slope > kEnough * value)) return false;
  double t = 1;
  for (int trial = 0; trial < kMostBacktracks; ++trial, t *= kShortening) {
    const Points next = x - t * direction;
    if (objective_.evaluate_held(next, norm) > value - kSufficientDecrease * t * slope) continue;
    x = next;
    return true;
  }
  return false;
}

Points HeldRotations::lowest_from(Points x, std::stop_token stop) {
  double eps2 = norm_.lowest_p() < 2 ? kFirstSmoothing : 0;
  do {
    const LpNorm norm = norm_.smoothed(eps2);
    for (int k = 0; k < kMostIterations && !stop.stop_requested() && descend(x, norm); ++k) continue;
    eps2 *= kSmoothingStep;
  } while (eps2 >= kLastSmoothing);
  return x;
}

double HeldRotations::length(const Points& x) {
  return std::pow(norm_.true_energy(objective_.evaluate_held(x, norm_)), 1 / norm_.lowest_p());
}

double HeldRotations::gap(const Points& x, std::stop_token stop) {
  objective_.evaluate_held(x, norm_);
  const double diagonal = shape_->diagonal() / shape_->mean_edge_length();
  return relative_gap({objective_, metric_, constraints_, norm_, kTolerance, 1, diagonal, 0, 0, stop}, x);
}

}  // namespace

double ConvexStep::spread() const {
  const auto [low, high] = std::ranges::minmax(lengths);
  return low > 0 ? (high - low) / low : 0;
}

absl::StatusOr<ConvexStep> convex_step(const std::shared_ptr<const RestShape>& shape, const PaperPose& pose,
                                       double p, int random_starts, std::stop_token stop) {
  absl::StatusOr<Constraints> constraints = make_constraints(*shape, pose.handles, FreeComponents::kError);
  if (!constraints.ok()) return constraints.status();
  absl::StatusOr<Metric> metric = Metric::create(shape);
  if (!metric.ok()) return metric.status();
  HeldRotations held(shape, *std::move(constraints), *std::move(metric), p);
  const std::optional<Points> naive = held.begin();
  if (!naive) return absl::InternalError("The Laplacian of this mesh cannot be factored.");

  std::vector<Points> starts{*naive, held.rest()};
  std::mt19937 random(2012);
  for (int k = 0; k < random_starts; ++k) starts.push_back(held.shaken(*naive, random));
  ConvexStep result{p, {}, 1};
  Points lowest;
  for (Points& start : starts) {
    Points end = held.lowest_from(std::move(start), stop);
    result.lengths.push_back(held.length(end));
    if (result.lengths.back() == std::ranges::min(result.lengths)) lowest = std::move(end);
  }
  result.certified = 1 - std::pow(1 - held.gap(lowest, stop), 1 / p);
  if (stop.stop_requested()) return absl::CancelledError();
  return result;
}

}  // namespace lpdeform::reproduce
