#pragma once

#include <array>

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// How a surface bends, integrated over the cell of each vertex: a symmetric 3 x 3 matrix a vertex,
///
///   B_i = sum over edges e at i of (beta_e |e| / 2) t_e t_e^T
///
/// beta_e is the angle between the normals of the edge's two faces, in radians, positive where the surface is
/// convex there; t_e the unit tangent across the edge. Divided by an area, t^T B t is the normal curvature in
/// direction t (Cohen-Steiner & Morvan 2003, with the tangents across the edges in place of those along
/// them). Edges of one face, of more than two, of a zero-area face, or whose faces disagree about the
/// orientation count as flat. Lengths are in scaled units. Positive is convex whatever way a component is
/// oriented (outward_signs).
struct BendingMeasure {
  Points diagonal;      // n x 3: xx, yy, zz
  Points off_diagonal;  // n x 3: xy, xz, yz

  /// The matrix of vertex i.
  Eigen::Matrix3d at(Eigen::Index i) const;
};

/// `is_absolute`: with |beta_e| in place of beta_e.
BendingMeasure bending_measure(const RestShape& shape, bool is_absolute = false);

}  // namespace lpdeform
