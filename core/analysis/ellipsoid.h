#pragma once

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// How far each vertex lies from the ellipsoid nearest to its component, as a share of the ellipsoid's radius there:
///
///   d_i = |r_i - 1|,    r_i^2 = (x_i - m)^T Q (x_i - m) / k
///
/// with (x - m)^T Q (x - m) = k the quadric that fits the component's vertices best, in the sense of least squares
/// weighted by area. 0 on balls and ellipsoids, however they are sampled and turned; it stays the same where the shape
/// is scaled along any axes, but for noise and rounding. 1 where the best quadric is no ellipsoid, where there are too few
/// vertices to tell, on flat components, and for vertices that no face uses. Finite. O(n + m).
Field distance_from_ellipsoid(const RestShape& shape);

}  // namespace lpdeform
