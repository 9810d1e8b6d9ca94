#pragma once

#include "core/energy/rest_shape.h"
#include "core/problem/handles.h"

namespace lpdeform {

/// The factor of each cell's stiffness around handles with a footprint:
///
///   1 + (kFootprintStiffness - 1) (1 - (d_i / r)^2)^2     for d_i < r,     1 otherwise,
///
/// d_i is the length of the shortest path along rest edges to the handle's vertices or points, r the handle's radius
/// (Handle::footprint), both in the caller's units. Where footprints overlap, the largest factor counts. The
/// surroundings of the handle move with it almost rigidly but may rotate freely. So the effect of the handle is spread
/// over a disk whose size does not depend on the mesh's edge length. Without a footprint, a handle of one vertex pulls
/// out a spike, which is thinner the finer the mesh and the smaller p. Empty if no handle has a footprint.
Field footprint_stiffness(const RestShape& shape, const HandleSet& handles);

inline constexpr double kFootprintStiffness = 100;

}  // namespace lpdeform
