#pragma once

#include <array>
#include <span>

#include "core/base/geometry.h"
#include "core/shapes/tetrahedra_surface.h"

namespace lpdeform {

/// Signed distances to simple solids, negative inside, and blends of them. The generated shapes are made of these.

/// A segment from a to b with a radius at each end; a and b differ.
struct Capsule {
  Eigen::RowVector3d a, b;
  double radius_a, radius_b;
};
double distance_to(const Capsule& capsule, const Eigen::RowVector3d& point);

/// A solid cylinder along axis 0, 1 or 2 through `centre`, with edges rounded off with radius `rounding`, which must be
/// less than `radius` and `half_length`.
struct Cylinder {
  Eigen::RowVector3d centre;
  int axis;
  double radius, half_length;
  double rounding = 0;
};
double distance_to(const Cylinder& cylinder, const Eigen::RowVector3d& point);

/// An axis-aligned box with edges rounded off in the same way.
struct Box {
  Eigen::RowVector3d centre, half_sides;
  double rounding = 0;
};
double distance_to(const Box& box, const Eigen::RowVector3d& point);

/// The soft minimum of distances, -w log(sum of exp(-d / w)), w = `width`: the union of the solids, with inner edges
/// rounded over about w. The result ranges from -infinity to infinity; infinity if there are no distances.
double blended_union(std::span<const double> distances, double width);

/// The part of `solid` outside `hole`, with edges rounded over about `width`.
double blended_difference(double solid, double hole, double width);

/// The surface field = 0 within [low, high], sampled on cubes, `resolution` of them along the longest side, and
/// remeshed to well-shaped triangles. The field must be positive on the border and have a gradient of about unit length
/// near 0, and nowhere be steeper than kSteepestField.
TriangleMesh field_surface(const ImplicitField& field, const Eigen::RowVector3d& low,
                           const Eigen::RowVector3d& high, int resolution);

}  // namespace lpdeform
