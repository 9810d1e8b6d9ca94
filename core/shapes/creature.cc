#include <vector>

#include "core/base/check.h"
#include "core/shapes/distance_fields.h"
#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

using Point = Eigen::RowVector3d;

/// x points forward, y to the left, z up; the feet are near z = 0.
std::vector<Capsule> creature_parts() {
  std::vector<Capsule> parts{
      {{-0.24, 0, 0.44}, {0.22, 0, 0.46}, 0.145, 0.135},  // trunk
      {{0.26, 0, 0.50}, {0.44, 0, 0.76}, 0.095, 0.060},   // neck
      {{0.44, 0, 0.78}, {0.60, 0, 0.74}, 0.080, 0.050},   // head
      {{-0.30, 0, 0.44}, {-0.58, 0, 0.36}, 0.095, 0.062},
      {{-0.58, 0, 0.36}, {-0.86, 0, 0.46}, 0.062, 0.040},  // tail
  };
  for (const double side : {-1.0, 1.0}) {
    parts.push_back({{0.20, 0.11 * side, 0.40}, {0.24, 0.16 * side, 0.07}, 0.075, 0.055});  // front leg
    parts.push_back({{0.24, 0.16 * side, 0.06}, {0.29, 0.165 * side, 0.05}, 0.055, 0.045});
    parts.push_back({{-0.22, 0.11 * side, 0.40}, {-0.26, 0.16 * side, 0.07}, 0.085, 0.055});  // hind leg
    parts.push_back({{-0.26, 0.16 * side, 0.06}, {-0.21, 0.165 * side, 0.05}, 0.055, 0.045});
  }
  return parts;
}

}  // namespace

TriangleMesh creature(int resolution) {
  LPDEFORM_CHECK(resolution >= 24);
  constexpr double kBlendWidth = 0.018;
  const ImplicitField field = [parts = creature_parts()](const Point& point) {
    std::vector<double> distances;
    for (const Capsule& part : parts) distances.push_back(distance_to(part, point));
    return blended_union(distances, kBlendWidth);
  };
  return field_surface(field, {-0.96, -0.28, -0.06}, {0.72, 0.28, 0.94}, resolution);
}

}  // namespace lpdeform
