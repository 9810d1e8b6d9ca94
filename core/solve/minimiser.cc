#include "core/solve/minimiser.h"

namespace lpdeform {

void clear_held_rows(const Constraints& constraints, Points& values) {
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    if (constraints.is_held[i]) values.row(i).setZero();
  }
}

}  // namespace lpdeform
