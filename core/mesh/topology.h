#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace lpdeform {

/// Whether the triangle a b c has area 0 to rounding. With L its longest edge and M its largest coordinate:
///     twice its area <= (1e-12 L + 8 u M) L,   u = 2^-52.
/// The second term covers the rounding of corners far from the origin. Does not depend on the unit of length.
/// The mesh report and the weights use this same rule.
inline bool is_zero_area(const Eigen::RowVector3d& a, const Eigen::RowVector3d& b,
                         const Eigen::RowVector3d& c) {
  const double largest =
      std::max({a.cwiseAbs().maxCoeff(), b.cwiseAbs().maxCoeff(), c.cwiseAbs().maxCoeff()});
  // Powers of two keep the squares below from leaving the range of a double, and are exact.
  const bool is_in_range = largest > 1e-40 && largest < 1e40;
  const double unit =
      is_in_range ? 1 : std::exp2(-std::ilogb(std::max(largest, std::numeric_limits<double>::min())));
  const Eigen::RowVector3d ab = unit * b - unit * a, bc = unit * c - unit * b, ca = unit * a - unit * c;
  const double longest = std::sqrt(std::max({ab.squaredNorm(), bc.squaredNorm(), ca.squaredNorm()}));
  const double rounding = 8 * std::numeric_limits<double>::epsilon() * unit * largest;
  return !(ab.cross(ca).norm() > (1e-12 * longest + rounding) * longest);
}

}  // namespace lpdeform
