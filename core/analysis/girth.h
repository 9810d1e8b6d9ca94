#pragma once

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// How long the outline of a slice of the shape across `direction` is at each vertex; `direction` has length 1:
///
///   girth_i = L(h_i) / mean of L over the component's heights,    h_i = x_i . direction
///
/// L(h) is the length of the component's outline at height h, averaged over a tenth of its extent. girth_i is 1
/// everywhere on a cylinder along the direction, and small near the tips of the shape. It does not depend on the unit
/// of length. It is 1 for components without extent along the direction and for unreferenced vertices; always >= 0 and
/// finite. O(n + m).
Field girth_along(const RestShape& shape, const Eigen::Vector3d& direction);

}  // namespace lpdeform
