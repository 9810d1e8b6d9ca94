#include "core/solve/minimiser.h"

namespace lpdeform {

bool Problem::factor_metric() const {
  return metric.factor(objective.cells().cell_weights(), constraints.is_held, objective.matrix_entries());
}

void Problem::solve(Points& v) const {
  metric.solve(v, v);
}

void Problem::precondition(const Points& b, Points& x) const {
  metric.precondition(b, x, workers());
}

void restrict_to_free(const Constraints& constraints, Points& values) {
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    if (constraints.is_held[i]) values.row(i).setZero();
  }
}

}  // namespace lpdeform
