#pragma once

#include <cstdint>
#include <vector>

#include "core/energy/rest_shape.h"
#include "core/problem/handles.h"

namespace lpdeform {

/// The vertices within 1 % of their component's extent from its lowest and its highest along any of the axes with
/// `is_wanted`, ascending. `axes`: rows, orthonormal.
std::vector<std::int32_t> ends_along(const RestShape& shape, const Eigen::Matrix3d& axes,
                                     const Eigen::Array<bool, 3, 1>& is_wanted);

/// What keeps the extent of a shape along two of the axes while it is stretched along the third, number `stretched`: handles that
/// hold ends along the two in their planes, so that they are free along the others. At each end of a component those
/// that lie farthest from each other, at most 32, and not those that are ends along the third axis as well. Each holds at
/// most 480 vertices (a plane lock is an equation, see LinearConstraints): of 241 components and more none. 0 to 2 handles.
std::vector<Handle> side_locks(const RestShape& shape, const Eigen::Matrix3d& axes, int stretched);

/// `positions` with the extents of `wanted`: each component is scaled and moved along each axis so that its lowest and
/// its highest become those that it has in `wanted`, to rounding. Vertices that no face uses become those of `wanted`.
Points with_extents(const RestShape& shape, const Eigen::Matrix3d& axes, const Points& positions,
                    const Points& wanted);

}  // namespace lpdeform
