#pragma once

#include <vector>

#include "core/base/workers.h"
#include "core/energy/rest_shape.h"

namespace lpdeform {

/// How thick the solid is behind each face, in scaled units: the length of the ray from the face's centre
/// along the inward normal to where it leaves the solid: the first face met from behind whose normal is
/// within 60 degrees of the ray, so that a fold or a corner beside the face is not taken for its other side.
/// Infinite where it meets none (open surfaces) and for zero-area faces; at least half the mean edge, so that
/// doubled faces count as thin and no more. Inward is decided for each component by the sign of its volume,
/// so a mesh that is inside out gives the same. The rays are cast through a tree of boxes: O(m log m). Runs
/// on `workers`; the same bits on any number of threads.
std::vector<double> thickness_behind_faces(const RestShape& shape, const Workers& workers);

/// +1 for each component whose faces' normals point outwards by its volume, -1 where they point inwards.
std::vector<double> outward_signs(const RestShape& shape);

}  // namespace lpdeform
