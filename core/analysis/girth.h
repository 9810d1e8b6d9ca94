#pragma once

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// How much surface a slice of the shape across `direction`, of length 1, cuts at each vertex:
///
///   girth_i = L(h_i) / mean of L over the component's heights,    h_i = x_i . direction
///
/// with L(h) the length of the component's outline at height h, a mean over a tenth of its extent: 1 everywhere on a
/// cylinder along the direction, small where the shape has its tips. Does not depend on the unit of length. 1 for components
/// without extent along the direction and for unreferenced vertices; >= 0 and finite. O(n + m).
Field girth_along(const RestShape& shape, const Eigen::Vector3d& direction);

}  // namespace lpdeform
