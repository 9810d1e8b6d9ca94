#include "core/solve/deformer_impl.h"

#include <algorithm>
#include <utility>

namespace lpdeform {
namespace {

constexpr double kFarthestGuess = 2;  // the guess continues the last move by less than this factor
constexpr double kSameWay = 0.5;      // two moves count as one drag above this squared cosine between them
// In such a drag, the squared ratio of the surface's largest move to the handles' largest move is below this.
constexpr double kSteady = 9;

}  // namespace

/// The soft terms as springs (p = 2, for cells of weight 1), evaluated at the rest shape with held vertices at their
/// targets.
SoftTerms Deformer::Impl::guess_springs() const {
  SoftTerms springs = constraints->soft;
  springs.evaluate(constraints->targets, LpNorm(Material::uniform(2), shape->vertex_count(), unit(), 1));
  return springs;
}

/// x = rest + u, where u is the harmonic extension of the handles' displacements: the solution of the naive Laplacian
/// system L x = L p with given handle positions and with soft terms as springs.
Points Deformer::Impl::laplacian_guess() {
  Points u = constraints->targets - shape->scaled_positions();
  Points forces = Points::Zero(u.rows(), 3);
  guess_springs().add_gradient(forces);
  forces = -forces;
  metric.extend(constraints->is_held, u, workers(), &forces);
  return shape->scaled_positions() + u;
}

/// Extrapolates a drag: if the handles move in about the same way as the last time, by the factor `share` of that move,
/// the surface does the same. The remaining displacement of handles and soft targets is extended harmonically.
Points Deformer::Impl::current_guess() {
  Points last = std::exchange(x_before_move, x);
  last = last.rows() == x.rows() ? Points(x - last) : Points(Points::Zero(x.rows(), 3));
  Points u = Points::Zero(x.rows(), 3), forces = u;
  double along = 0, size = 0, left = 0, longest = 0;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (!constraints->is_held[i]) continue;
    u.row(i) = constraints->targets.row(i) - x.row(i);
    along += u.row(i).dot(last.row(i));
    size += last.row(i).squaredNorm();
    longest = std::max(longest, last.row(i).squaredNorm());
    left += u.row(i).squaredNorm();
  }
  const SoftTerms& before = objective.soft_terms();
  if (constraints->soft.has_rows_of(before)) constraints->soft.add_pull(before, forces);
  if (left == 0 && forces.isZero(0)) return x;
  const double share = size > 0 ? along / size : 0;
  const bool goes_on = share > 0 && share < kFarthestGuess && along * along > kSameWay * size * left &&
                       last.rowwise().squaredNorm().maxCoeff() < kSteady * longest;
  if (goes_on) {
    forces.setZero();  // soft targets move with the drag
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      if (constraints->is_held[i]) u.row(i) -= share * last.row(i);
    }
  }
  metric.extend(constraints->is_held, u, workers(), &forces);
  if (goes_on) u += share * last;
  return x + u;
}

Points Deformer::Impl::initial_guess(InitialGuess guess) {
  Points result;
  if (guess == InitialGuess::kRest)
    result = constraints->targets;
  else if (guess == InitialGuess::kCurrent && state != State::kUntouched)
    result = current_guess();
  else
    result = laplacian_guess();
  // Sets held vertices exactly to their targets, which removes the solve's rounding.
  for (Eigen::Index i = 0; i < result.rows(); ++i) {
    if (constraints->is_held[i]) result.row(i) = constraints->targets.row(i);
  }
  constraints->linear.satisfy_within(metric, result, workers());
  return result;
}

}  // namespace lpdeform
