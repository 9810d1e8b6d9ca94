#pragma once

#include <array>
#include <functional>

#include "core/mesh/mesh.h"

namespace lpdeform {

/// A scalar field in space, negative inside the solid.
using ImplicitField = std::function<double(const Eigen::RowVector3d&)>;

/// The cubes of a regular grid: its lowest corner, the side of a cube, and their number along each axis.
struct SampleGrid {
  Eigen::RowVector3d origin;
  double spacing = 1;
  std::array<int, 3> cells{1, 1, 1};
};

/// Between two points a field may differ by at most this many times their distance.
inline constexpr double kSteepestField = 2;

/// The surface field = 0 by marching tetrahedra, six per cube (Freudenthal's subdivision, whose tetrahedra meet face to
/// face). The slope of the field must be at most kSteepestField in the grid and up to seven cubes around it: where the
/// field is far from 0, one value decides for many samples. If the field is positive on the border of the grid, the
/// surface is closed, manifold and oriented outwards. A sample of exactly 0 counts as outside. Triangles may be slivers.
TriangleMesh tetrahedra_surface(const ImplicitField& field, const SampleGrid& grid);

}  // namespace lpdeform
