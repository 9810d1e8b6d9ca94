#include "core/problem/handle.h"

#include <Eigen/Geometry>

namespace lpdeform {

bool TargetPositions::operator==(const TargetPositions& other) const {
  return positions.rows() == other.positions.rows() && positions == other.positions;
}

Points rest_positions(const Handle& handle, const Points& rest, const Faces& faces) {
  Points result(handle.size(), 3);
  for (std::size_t k = 0; k < handle.vertices.size(); ++k) result.row(k) = rest.row(handle.vertices[k]);
  for (std::size_t k = 0; k < handle.points.size(); ++k) {
    const SurfacePoint& point = handle.points[k];
    result.row(k).setZero();
    for (int c = 0; c < 3; ++c) result.row(k) += point.barycentric[c] * rest.row(faces(point.face, c));
  }
  return result;
}

Eigen::Matrix3d rotation_of(const HandleMotion& motion) {
  const auto* rigid = std::get_if<RigidMotion>(&motion);
  if (rigid == nullptr || rigid->angle_radians == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(rigid->angle_radians, rigid->axis.stableNormalized()).toRotationMatrix();
}

Points target_positions(const Handle& handle, const Points& rest, const Faces& faces) {
  if (const auto* targets = std::get_if<TargetPositions>(&handle.motion)) return targets->positions;
  Points result = rest_positions(handle, rest, faces);
  if (const auto* rigid = std::get_if<RigidMotion>(&handle.motion)) {
    if (rigid->angle_radians != 0) {
      const Eigen::RowVector3d center = rigid->center.transpose();
      result = ((result.rowwise() - center) * rotation_of(handle.motion).transpose()).rowwise() + center;
    }
    result.rowwise() += rigid->translation.transpose();
  }
  return result;
}

}  // namespace lpdeform
