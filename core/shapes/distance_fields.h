#pragma once

#include <array>
#include <span>

#include "core/base/geometry.h"
#include "core/shapes/tetrahedra_surface.h"

namespace lpdeform {

/// Signed distances to simple solids, negative inside, and their blends: what the generated shapes are made
/// of.

/// A segment from a to b with a radius at each end; a and b differ.
struct Capsule {
  Eigen::RowVector3d a, b;
  double radius_a, radius_b;
};
double distance_to(const Capsule& capsule, const Eigen::RowVector3d& point);

/// A solid cylinder along axis 0, 1 or 2 through `centre`, its edges rounded off to a radius of `rounding`, less
/// than the others.
struct Cylinder {
  Eigen::RowVector3d centre;
  int axis;
  double radius, half_length;
  double rounding = 0;
};
double distance_to(const Cylinder& cylinder, const Eigen::RowVector3d& point);

/// A box with its faces across the axes, its edges rounded off likewise.
struct Box {
  Eigen::RowVector3d centre, half_sides;
  double rounding = 0;
};
double distance_to(const Box& box, const Eigen::RowVector3d& point);

/// A soft minimum of distances, -w log(sum of exp(-d / w)): the solids' union, its inner edges rounded over
/// about w. -infinity to infinity; infinity where there is none.
double blended_union(std::span<const double> distances, double width);

/// What of `solid` lies outside `hole`, edges rounded over about `width`.
double blended_difference(double solid, double hole, double width);

/// The surface of `field` within [low, high] from cubes of which `resolution` lie along the longest side, its
/// triangles made well shaped. The field must be positive on the border and have a gradient of about unit
/// length near 0.
TriangleMesh field_surface(const ImplicitField& field, const Eigen::RowVector3d& low,
                           const Eigen::RowVector3d& high, int resolution);

}  // namespace lpdeform
