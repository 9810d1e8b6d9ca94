#include "core/analysis/salience.h"

#include <algorithm>
#include <numbers>

#include "core/analysis/component_lengths.h"
#include "core/analysis/surface_smoother.h"

namespace lpdeform {
namespace {

constexpr double kHalf = std::numbers::pi / 6;

}  // namespace

BendingMeasure smoothed_bending(const RestShape& shape) {
  SurfaceSmoother smoother(shape);
  const BendingMeasure bending = bending_measure(shape, true);
  if (!smoother.set_lengths(component_lengths(shape)))
    return {Points::Zero(shape.vertex_count(), 3), Points::Zero(shape.vertex_count(), 3)};
  return {smoother.spread(bending.diagonal), smoother.spread(bending.off_diagonal)};
}

Field salience(const RestShape& shape, const BendingMeasure& smoothed, const Eigen::Matrix3d& directions,
               const Eigen::Vector3d& weights) {
  const std::vector<double> lengths = component_lengths(shape);
  Field result = Field::Zero(shape.vertex_count());
  for (Eigen::Index i = 0; i < result.size(); ++i) {
    const std::int32_t component = shape.components()[i];
    if (component < 0) continue;
    const Eigen::Vector3d along = (directions * smoothed.at(i) * directions.transpose()).diagonal();
    const double angle = 2 * lengths[component] * std::max(0.0, weights.dot(along));
    result[i] = 1 - 1 / (1 + angle * angle / (kHalf * kHalf));
  }
  return result;
}

}  // namespace lpdeform
