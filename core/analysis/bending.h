#pragma once

#include <array>

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// How a surface bends, integrated over the cell of each vertex: one symmetric 3 x 3 matrix per vertex,
///
///   B_i = sum over edges e at i of (beta_e |e| / 2) t_e t_e^T
///
/// beta_e is the angle between the normals of the edge's two faces, in radians, positive where the surface is convex.
/// t_e is the unit tangent across the edge. Divided by an area, t^T B t is the normal curvature in direction t
/// (Cohen-Steiner & Morvan 2003, with tangents across the edges in place of tangents along them). An edge counts as
/// flat if it has one face or more than two, if one of its faces has zero area, or if its faces disagree about the
/// orientation. Lengths are in scaled units. Positive means convex, whichever way a component is oriented
/// (outward_signs).
struct BendingMeasure {
  Points diagonal;      // n x 3: xx, yy, zz
  Points off_diagonal;  // n x 3: xy, xz, yz

  /// The matrix of vertex i.
  Eigen::Matrix3d at(Eigen::Index i) const;
};

/// `is_absolute`: uses |beta_e| in place of beta_e.
BendingMeasure bending_measure(const RestShape& shape, bool is_absolute = false);

}  // namespace lpdeform
