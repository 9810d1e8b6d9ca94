#include "core/methods/objective.h"

#include <algorithm>

namespace lpdeform {

double Objective::evaluate(const Points& x, const LpNorm& norm) {
  ++evaluations_;
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

std::vector<double> Objective::soft_weights() const {
  std::vector<double> weights = soft_.weights();
  if (weights.empty()) return weights;
  const std::vector<double>& cells = cells_.cell_weights();
  const double lowest = Metric::kLowestShare * *std::max_element(cells.begin(), cells.end());
  for (double& weight : weights) weight = std::max(weight, lowest);
  return weights;
}

}  // namespace lpdeform
