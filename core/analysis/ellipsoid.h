#pragma once

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// How far each vertex lies from the best-fitting ellipsoid of its component, as a share of the ellipsoid's radius
/// there:
///
///   d_i = |r_i - 1|,    r_i^2 = (x_i - m)^T Q (x_i - m) / k
///
/// (x - m)^T Q (x - m) = k is the quadric that fits the component's vertices best by least squares weighted by area.
/// d_i is 0 on balls and ellipsoids, however they are sampled and rotated. Except for noise and rounding, it does not
/// change if the shape is scaled along any axes. It is 1 if the best quadric is not an ellipsoid, if the component has
/// too few vertices to tell, on flat components, and for vertices that no face uses. Finite. O(n + m).
Field distance_from_ellipsoid(const RestShape& shape);

}  // namespace lpdeform
