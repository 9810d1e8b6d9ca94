#include <array>

#include "core/base/check.h"
#include "core/shapes/distance_fields.h"
#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

using Point = Eigen::RowVector3d;

double arm_field(const Point& point) {
  constexpr double kBlendWidth = 0.028, kHalfHeight = 0.15, kRounding = 0.05;
  static const Cylinder kRing{{0, 0, 0}, 2, 0.31, kHalfHeight, kRounding};
  static const Cylinder kHole{{0, 0, 0}, 2, RockerArm::kHoleRadius, 1};
  static const Capsule kArm{{0.25, 0, 0}, {0.86, 0, 0}, 0.13, 0.085};
  static const Cylinder kEye{{0.94, 0, 0}, 2, 0.15, 0.13, kRounding};
  static const Capsule kTail{{-0.25, 0, 0}, {-0.62, 0, 0}, 0.12, 0.09};
  const double solid = blended_union(std::array{distance_to(kRing, point), distance_to(kArm, point),
                                                distance_to(kEye, point), distance_to(kTail, point)},
                                     kBlendWidth);
  return blended_difference(solid, distance_to(kHole, point), kBlendWidth);
}

}  // namespace

TriangleMesh rocker_arm(int resolution) {
  LPDEFORM_CHECK(resolution >= 32);
  return field_surface(arm_field, {-0.79, -0.39, -0.21}, {1.17, 0.39, 0.21}, resolution);
}

}  // namespace lpdeform
