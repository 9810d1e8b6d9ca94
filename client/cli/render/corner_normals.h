#pragma once

#include "core/base/geometry.h"

namespace lpdeform {

/// A normal of length 1 for each corner of each face, 3 f + k for corner k of face f: the area-weighted mean
/// of the faces at its vertex that bend away from face f by less than 40 degrees, so that round parts look
/// round and edges stay sharp. Faces that look the opposite way are turned first. Zero where the face has no
/// area.
Points corner_normals(const Points& positions, const Faces& faces);

}  // namespace lpdeform
