#pragma once

#include "core/base/geometry.h"

namespace lpdeform {

/// A triangle mesh as its owner sees it: vertex order is never changed. Not necessarily a sound one: see
/// check_mesh.
struct TriangleMesh {
  Points vertices;
  Faces faces;
};

}  // namespace lpdeform
