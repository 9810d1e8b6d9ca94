#include "core/methods/minimiser.h"

#include <numeric>

namespace lpdeform {

bool Problem::is_zero(double sum) const {
  if (sum > zero_objective) return false;
  if (norm.lowest_p() == norm.highest_p()) return true;
  const auto& e2 = objective.cells().squared_energies();
  return std::accumulate(e2.begin(), e2.end(), 0.0) <= zero_squares;
}

bool Problem::factor_metric(const std::vector<double>& cell_weights, Metric::Precision precision) const {
  std::vector<MatrixEntry> entries = objective.soft_terms().matrix_entries(objective.soft_weights());
  if (!constraints.linear.empty()) {
    precision = Metric::Precision::kDouble;
    const double sum = std::accumulate(cell_weights.begin(), cell_weights.end(), 0.0);
    constraints.linear.add_ties(2 * sum / static_cast<double>(cell_weights.size()), entries);
  }
  return metric.factor(cell_weights, constraints.is_held, entries, workers(), precision);
}

void Problem::solve(const Points& b, Points& x) const {
  const auto inverse = [this](Points& v) { metric.solve(v, v, workers()); };
  metric.solve(b, x, workers());
  constraints.linear.project(metric, inverse, x, workers());
}

void Problem::precondition(const Points& b, Points& x) const {
  const auto inverse = [this](Points& v) { metric.precondition(v, v, workers()); };
  metric.precondition(b, x, workers());
  constraints.linear.project(metric, inverse, x, workers());
}

void Problem::precondition(const Points& b, SinglePoints& x) const {
  if (constraints.linear.empty()) return metric.precondition(b, x, workers());
  Points precise;
  precondition(b, precise);
  x = precise.cast<float>();
}

void restrict_to_free(const Constraints& constraints, Points& values) {
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    if (constraints.is_held[i]) values.row(i).setZero();
  }
  constraints.linear.restrict(values);
}

}  // namespace lpdeform
