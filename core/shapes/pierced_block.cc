#include <array>

#include "core/base/check.h"
#include "core/shapes/distance_fields.h"
#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

using Point = Eigen::RowVector3d;

double block_field(const Point& point) {
  constexpr double kBlendWidth = 1.1, kRounding = 2.5, kHalfSide = PiercedBlock::kHalfSide;
  static const Box kCube{{0, 0, 0}, {kHalfSide, kHalfSide, kHalfSide}, kRounding};
  static const Cylinder kShaft{{0, 0, 0}, 2, 6.5, PiercedBlock::kHalfLength, kRounding};
  static const Cylinder kAlongX{{0, 0, 0}, 0, PiercedBlock::kHoleRadius, 2 * kHalfSide};
  static const Cylinder kAlongY{{0, 0, 0}, 1, PiercedBlock::kHoleRadius, 2 * kHalfSide};
  const double solid =
      blended_union(std::array{distance_to(kCube, point), distance_to(kShaft, point)}, kBlendWidth);
  const double holes =
      blended_union(std::array{distance_to(kAlongX, point), distance_to(kAlongY, point)}, kBlendWidth);
  return blended_difference(solid, holes, kBlendWidth);
}

}  // namespace

TriangleMesh pierced_block(int resolution) {
  LPDEFORM_CHECK(resolution >= 24);
  return field_surface(block_field, {-11.5, -11.5, -20.5}, {11.5, 11.5, 20.5}, resolution);
}

}  // namespace lpdeform
