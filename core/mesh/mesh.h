#pragma once

#include "core/base/geometry.h"

namespace lpdeform {

/// A triangle mesh in its owner's vertex order, which is never changed. The mesh may have defects: see check_mesh.
struct TriangleMesh {
  Points vertices;
  Faces faces;
};

}  // namespace lpdeform
