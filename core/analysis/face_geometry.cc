#include "core/analysis/face_geometry.h"

#include <Eigen/Geometry>

#include "core/mesh/topology.h"

namespace lpdeform {

FaceGeometry face_geometry(const RestShape& shape, Eigen::Index face) {
  const auto corner = [&](int k) -> Eigen::RowVector3d {
    return shape.scaled_positions().row(shape.faces()(face, k));
  };
  const Eigen::RowVector3d a = corner(0), b = corner(1), c = corner(2);
  FaceGeometry geometry{(a + b + c) / 3, Eigen::RowVector3d::Zero(), 0};
  if (is_zero_area(a, b, c)) return geometry;
  const Eigen::RowVector3d twice = (b - a).cross(c - a);
  const double length = twice.norm();
  geometry.normal = twice / length;
  geometry.area = length / 2;
  return geometry;
}

Field vertex_areas(const RestShape& shape) {
  Field areas = Field::Zero(shape.vertex_count());
  for (Eigen::Index f = 0; f < shape.faces().rows(); ++f) {
    const double share = face_geometry(shape, f).area / 3;
    for (int corner = 0; corner < 3; ++corner) areas[shape.faces()(f, corner)] += share;
  }
  return areas;
}

}  // namespace lpdeform
