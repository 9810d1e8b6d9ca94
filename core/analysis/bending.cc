#include "core/analysis/bending.h"

#include <Eigen/Geometry>
#include <cmath>
#include <span>

#include "core/analysis/face_geometry.h"
#include "core/analysis/thickness.h"
#include "core/mesh/half_edges.h"

namespace lpdeform {
namespace {

/// The bend at an edge: its angle, its length and the tangent across it.
struct Bend {
  double angle = 0;
  double length = 0;
  Eigen::RowVector3d across = Eigen::RowVector3d::Zero();
};

/// `left` and `right`: half-edges of the two faces, which run in opposite directions.
Bend bend_of(const RestShape& shape, std::int32_t left, std::int32_t right) {
  const FaceGeometry a = face_geometry(shape, left / 3), b = face_geometry(shape, right / 3);
  if (a.area == 0 || b.area == 0) return {};
  const auto position = [&](std::int32_t corner) -> Eigen::RowVector3d {
    return shape.scaled_positions().row(shape.faces()(corner / 3, corner % 3));
  };
  const Eigen::RowVector3d edge = position(next_corner(left)) - position(left);
  const double length = edge.norm();
  const Eigen::RowVector3d direction = edge / length;
  const double angle = std::atan2(direction.dot(a.normal.cross(b.normal)), a.normal.dot(b.normal));
  // Each face has a tangent that leaves it across the edge. Their mean is the tangent across the edge, even if the edge
  // is sharp.
  const Eigen::RowVector3d across = (a.normal - b.normal).norm() < 1e-6
                                        ? Eigen::RowVector3d(a.normal.cross(direction))
                                        : Eigen::RowVector3d((a.normal + b.normal).cross(direction));
  return {angle, length, across.stableNormalized()};
}

void add(BendingMeasure& measure, std::int32_t vertex, double amount, const Eigen::RowVector3d& t) {
  measure.diagonal.row(vertex) += amount * t.cwiseProduct(t);
  measure.off_diagonal.row(vertex) += amount * Eigen::RowVector3d(t[0] * t[1], t[0] * t[2], t[1] * t[2]);
}

}  // namespace

Eigen::Matrix3d BendingMeasure::at(Eigen::Index i) const {
  Eigen::Matrix3d matrix;
  matrix << diagonal(i, 0), off_diagonal(i, 0), off_diagonal(i, 1),  //
      off_diagonal(i, 0), diagonal(i, 1), off_diagonal(i, 2),        //
      off_diagonal(i, 1), off_diagonal(i, 2), diagonal(i, 2);
  return matrix;
}

BendingMeasure bending_measure(const RestShape& shape, bool is_absolute) {
  const Faces& faces = shape.faces();
  const std::vector<double> signs = outward_signs(shape);
  const Eigen::Index n = shape.vertex_count();
  BendingMeasure measure{Points::Zero(n, 3), Points::Zero(n, 3)};
  const EdgeTable table(n, faces, [](Eigen::Index) { return true; });
  table.for_edges([&](std::int32_t low, std::int32_t high, std::span<const HalfEdge> sides) {
    if (sides.size() != 2) return;
    const std::int32_t left = sides[0].id, right = sides[1].id;
    if (faces(left / 3, left % 3) == faces(right / 3, right % 3)) return;
    const Bend bend = bend_of(shape, left, right);
    const double angle = is_absolute ? std::abs(bend.angle) : signs[shape.components()[low]] * bend.angle;
    const double half = angle * bend.length / 2;
    add(measure, low, half, bend.across);
    add(measure, high, half, bend.across);
  });
  return measure;
}

}  // namespace lpdeform
