#pragma once

#include "core/energy/rest_shape.h"
#include "core/problem/handles.h"

namespace lpdeform {

/// The factor of each cell's stiffness around handles with a footprint:
///
///   1 + (kFootprintStiffness - 1) (1 - (d_i / r)^2)^2     where d_i < r,     1 elsewhere,
///
/// d_i the length of the shortest way along rest edges to the handle's vertices or points, r its radius
/// (Handle::footprint), the caller's units; where footprints overlap the largest counts. The surroundings of a
/// handle go along with it nearly rigidly and turn as they like, so that what the handle does to the surface is
/// spread over a disk that does not shrink with the mesh's edges. Without it a handle of one vertex pulls a
/// spike: the finer the mesh and the smaller p, the thinner. Empty where no handle has one.
Field footprint_stiffness(const RestShape& shape, const HandleSet& handles);

inline constexpr double kFootprintStiffness = 100;

}  // namespace lpdeform
