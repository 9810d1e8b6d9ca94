#pragma once

#include <cstdint>
#include <vector>

#include "core/energy/rest_shape.h"
#include "core/problem/handles.h"

namespace lpdeform {

/// The vertices within 1 % of their component's extent from its lowest or highest coordinate along any of the axes for
/// which `is_wanted` is true, ascending. `axes`: orthonormal rows.
std::vector<std::int32_t> ends_along(const RestShape& shape, const Eigen::Matrix3d& axes,
                                     const Eigen::Array<bool, 3, 1>& is_wanted);

/// Handles that preserve the extent of a shape along two axes while it is stretched along the third, axis number
/// `stretched`. For each of the two axes, one handle locks end vertices to planes perpendicular to it, so that they can
/// move along the other axes. At each end of a component it holds at most 32 vertices, chosen far apart from each
/// other, and none that is also an end along the stretched axis. Each handle holds at most 480 vertices, because each
/// plane lock is an equation (see LinearConstraints); with more than 240 components there are no handles. Returns 0 to
/// 2 handles.
std::vector<Handle> side_locks(const RestShape& shape, const Eigen::Matrix3d& axes, int stretched);

/// `positions` with the extents of `wanted`: each component is scaled and moved along each axis so that its lowest and
/// highest coordinates become those in `wanted`, to rounding. Vertices that no face uses get their positions in
/// `wanted`.
Points with_extents(const RestShape& shape, const Eigen::Matrix3d& axes, const Points& positions,
                    const Points& wanted);

}  // namespace lpdeform
