#include "core/solve/objective.h"

namespace lpdeform {

double Objective::evaluate(const Points& x, const LpNorm& norm) {
  return cells_.evaluate(x, norm) + soft_.evaluate(x, norm);
}

double Objective::evaluate_held(const Points& x, const LpNorm& norm) {
  return cells_.evaluate_held(x, norm) + soft_.evaluate(x, norm);
}

double Objective::reweigh(const LpNorm& norm) {
  return cells_.reweigh(norm) + soft_.reweigh(norm);
}

double Objective::sum(const LpNorm& norm) const {
  return cells_.sum(norm) + soft_.sum(norm);
}

void Objective::gradient(Points& result) const {
  cells_.gradient(result);
  soft_.add_gradient(result);
}

}  // namespace lpdeform
