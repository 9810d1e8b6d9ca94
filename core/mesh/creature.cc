#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/check.h"
#include "core/mesh/remesh.h"
#include "core/mesh/shapes.h"
#include "core/mesh/tetrahedra_surface.h"

namespace lpdeform {
namespace {

using Point = Eigen::RowVector3d;

/// A segment from a to b with a radius at each end.
struct Capsule {
  Point a, b;
  double radius_a, radius_b;
};

/// x looks forward, y to the left, z up; the feet stand near z = 0.
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

double distance_to(const Capsule& capsule, const Point& point) {
  const Point along = capsule.b - capsule.a;
  const double t = std::clamp((point - capsule.a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (point - capsule.a - t * along).norm() - std::lerp(capsule.radius_a, capsule.radius_b, t);
}

/// A soft minimum of the distances: -w log(sum of exp(-d / w)).
double blended(const std::vector<Capsule>& parts, const Point& point) {
  constexpr double kBlendWidth = 0.018;
  double sum = 0;
  for (const Capsule& part : parts) sum += std::exp(-distance_to(part, point) / kBlendWidth);
  return -kBlendWidth * std::log(std::max(sum, 1e-300));
}

}  // namespace

TriangleMesh creature(int resolution) {
  LPDEFORM_CHECK(resolution >= 24);
  const Point low(-0.96, -0.28, -0.06), high(0.72, 0.28, 0.94);
  SampleGrid grid{low, (high[0] - low[0]) / resolution, {}};
  for (int axis = 0; axis < 3; ++axis) {
    grid.cells[axis] = static_cast<int>(std::ceil((high[axis] - low[axis]) / grid.spacing));
  }
  const ImplicitField field = [parts = creature_parts()](const Point& point) {
    return blended(parts, point);
  };
  return remesh(tetrahedra_surface(field, grid), field, 0.6 * grid.spacing, 8);
}

}  // namespace lpdeform
