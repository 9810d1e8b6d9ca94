#include "core/shapes/distance_fields.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/shapes/remesh.h"

namespace lpdeform {
namespace {

using Point = Eigen::RowVector3d;

/// The signed distance, from how far a point is beyond each pair of faces: outside, the length of the positive
/// components; inside, the largest component. The solid is shrunk by `rounding` and then grown by it.
template <typename Vector>
double distance_beyond(const Vector& faces, double rounding) {
  const Vector beyond = faces.array() + rounding;
  return beyond.cwiseMax(0).norm() + std::min(beyond.maxCoeff(), 0.0) - rounding;
}

}  // namespace

double distance_to(const Capsule& capsule, const Point& point) {
  const Point along = capsule.b - capsule.a;
  const double t = std::clamp((point - capsule.a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (point - capsule.a - t * along).norm() - std::lerp(capsule.radius_a, capsule.radius_b, t);
}

double distance_to(const Cylinder& cylinder, const Point& point) {
  Point across = point - cylinder.centre;
  const double along = across[cylinder.axis];
  across[cylinder.axis] = 0;
  return distance_beyond(
      Eigen::RowVector2d(across.norm() - cylinder.radius, std::abs(along) - cylinder.half_length),
      cylinder.rounding);
}

double distance_to(const Box& box, const Point& point) {
  return distance_beyond(Point((point - box.centre).cwiseAbs() - box.half_sides), box.rounding);
}

double blended_union(std::span<const double> distances, double width) {
  double least = std::numeric_limits<double>::infinity(), sum = 0;
  for (const double distance : distances) least = std::min(least, distance);
  if (std::isinf(least)) return least;
  for (const double distance : distances) sum += std::exp((least - distance) / width);
  return least - width * std::log(sum);
}

double blended_difference(double solid, double hole, double width) {
  return -blended_union(std::array{-solid, hole}, width);
}

TriangleMesh field_surface(const ImplicitField& field, const Point& low, const Point& high, int resolution) {
  SampleGrid grid{low, (high - low).maxCoeff() / resolution, {}};
  for (int axis = 0; axis < 3; ++axis) {
    grid.cells[axis] = static_cast<int>(std::ceil((high[axis] - low[axis]) / grid.spacing));
  }
  return remesh(tetrahedra_surface(field, grid), field, 0.6 * grid.spacing, 8);
}

}  // namespace lpdeform
