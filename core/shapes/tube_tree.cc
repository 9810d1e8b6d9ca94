#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>

#include "core/base/check.h"
#include "core/shapes/distance_fields.h"
#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

using Point = Eigen::RowVector3d;

constexpr int kForks = 4;                                          // levels of branches above the trunk
constexpr double kShorter = 0.74, kThinner = 0.72, kSpread = 0.6;  // of each level; radians

/// Adds a branch and, above it, two more, each turned about the branch.
void grow(const Point& from, const Point& along, const Point& across, double length, double radius, int forks,
          std::vector<Capsule>& parts) {
  const Point to = from + length * along;
  parts.push_back({from, to, radius, kThinner * radius});
  if (forks == 0) return;
  const Point third = along.cross(across);
  for (const double side : {-1.0, 1.0}) {
    const Point way = std::cos(kSpread) * along + side * std::sin(kSpread) * across;
    grow(to, way, third, kShorter * length, kThinner * radius, forks - 1, parts);
  }
}

}  // namespace

TriangleMesh tube_tree(int resolution) {
  LPDEFORM_CHECK(resolution >= 48);
  std::vector<Capsule> parts;
  grow({0, 0, 0}, {0, 0, 1}, {1, 0, 0}, 0.5, 0.09, kForks, parts);
  Point low = parts[0].a, high = low;
  for (const Capsule& part : parts) {
    low = low.cwiseMin(part.a).cwiseMin(part.b);
    high = high.cwiseMax(part.a).cwiseMax(part.b);
  }
  const ImplicitField field = [parts](const Point& point) {
    std::vector<double> distances;
    for (const Capsule& part : parts) distances.push_back(distance_to(part, point));
    return blended_union(distances, 0.01);
  };
  return field_surface(field, low.array() - 0.15, high.array() + 0.15, resolution);
}

}  // namespace lpdeform
