#pragma once

#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include "core/base/geometry.h"
#include "core/problem/hold.h"

namespace lpdeform {

/// The handle stays at its rest positions.
struct Fixed {
  bool operator==(const Fixed&) const = default;
};

/// x = R (p - center) + center + translation for every vertex of the handle: rotation about `center` first, then
/// translation. `axis` need not have unit length; it may be 0 only if `angle_radians` is 0.
struct RigidMotion {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  double angle_radians = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  bool operator==(const RigidMotion&) const = default;
};

/// One target position per vertex or point, in the handle's order.
struct TargetPositions {
  Points positions;

  bool operator==(const TargetPositions&) const;
};

using HandleMotion = std::variant<Fixed, RigidMotion, TargetPositions>;

/// A group of vertices, or of points inside faces, that the user holds.
struct Handle {
  std::vector<std::int32_t> vertices;
  HandleMotion motion = Fixed{};
  Hold hold = Exactly{};
  /// Instead of vertices. Held Exactly or Soft.
  std::vector<SurfacePoint> points = {};
  /// Radius of the surroundings that move with the handle, in the caller's units; prevents the spike that a handle of
  /// one or a few vertices makes (footprint.h). Their additional stiffness counts in the energy. 0: no footprint.
  double footprint = 0;

  /// The number of vertices or points.
  std::size_t size() const { return vertices.size() + points.size(); }

  /// Whether the handle fixes its vertices: they are at their targets, not unknowns.
  bool fixes_vertices() const { return points.empty() && std::holds_alternative<Exactly>(hold); }

  bool operator==(const Handle&) const = default;
};

/// The rest positions and the target positions of a handle's vertices or points, one row each in their order. `faces`
/// are needed for points only.
Points rest_positions(const Handle& handle, const Points& rest, const Faces& faces = {});
Points target_positions(const Handle& handle, const Points& rest, const Faces& faces = {});

/// R of a rigid motion; the identity for any other motion.
Eigen::Matrix3d rotation_of(const HandleMotion& motion);

}  // namespace lpdeform
