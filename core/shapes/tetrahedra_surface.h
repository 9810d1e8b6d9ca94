#pragma once

#include <array>
#include <functional>

#include "core/mesh/mesh.h"

namespace lpdeform {

/// A value for each point of space, negative inside.
using ImplicitField = std::function<double(const Eigen::RowVector3d&)>;

/// The cubes of a regular grid: its lowest corner, the side of a cube, and their number along each axis.
struct SampleGrid {
  Eigen::RowVector3d origin;
  double spacing = 1;
  std::array<int, 3> cells{1, 1, 1};
};

/// The surface field = 0 by marching tetrahedra, six to a cube (Freudenthal's division, whose tetrahedra meet
/// face to face). Closed, manifold and oriented outwards where the field is positive on the border of the
/// grid; a sample of exactly 0 counts as outside. Its triangles can be slivers.
TriangleMesh tetrahedra_surface(const ImplicitField& field, const SampleGrid& grid);

}  // namespace lpdeform
