#pragma once

#include "core/base/geometry.h"

namespace lpdeform {

/// A unit normal for each corner of each face: 3 f + k for corner k of face f. It is the area-weighted mean
/// of the faces at the corner's vertex that are less than 40 degrees off face f, so that round parts look
/// round and edges stay sharp. Faces of opposite orientation are flipped first. Zero if the face has no area.
Points corner_normals(const Points& positions, const Faces& faces);

}  // namespace lpdeform
