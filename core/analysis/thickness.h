#pragma once

#include <vector>

#include "core/base/workers.h"
#include "core/energy/rest_shape.h"

namespace lpdeform {

/// How thick the solid is behind each face, in scaled units. A ray starts at the face's centre along the inward normal;
/// the thickness is its length up to where it leaves the solid. That is the first face it meets from behind whose
/// normal is within 60 degrees of the ray, so a fold or a corner beside the face is not mistaken for its other side.
/// Infinite if the ray meets no such face (open surfaces), and for zero-area faces. At least half the mean edge length,
/// so doubled faces do not count as thinner than that. The sign of each component's volume decides which way is inward,
/// so a mesh that is inside out gives the same result. The rays are cast through a tree of boxes: O(m log m). Runs on
/// `workers`; gives the same bits on any number of threads.
std::vector<double> thickness_behind_faces(const RestShape& shape, const Workers& workers);

/// One sign per component: +1 if its faces' normals point outwards, judged by the sign of its volume; -1 if they point
/// inwards.
std::vector<double> outward_signs(const RestShape& shape);

}  // namespace lpdeform
