#pragma once

#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/geometry.h"

namespace lpdeform {

/// The handle stays where the rest mesh has it.
struct Fixed {
  bool operator==(const Fixed&) const = default;
};

/// x = R (p - center) + center + translation for every vertex of the handle: rotation about `center` first,
/// then translation. `axis` need not have unit length; it may be 0 only where `angle_radians` is 0.
struct RigidMotion {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  double angle_radians = 0;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  bool operator==(const RigidMotion&) const = default;
};

/// One target position a vertex, in the order of the handle's vertices.
struct TargetPositions {
  Points positions;

  bool operator==(const TargetPositions&) const;
};

using HandleMotion = std::variant<Fixed, RigidMotion, TargetPositions>;

/// A group of vertices that the user holds.
struct Handle {
  std::vector<std::int32_t> vertices;
  HandleMotion motion = Fixed{};

  bool operator==(const Handle&) const = default;
};

/// All handles of a session, by name. A plain value: change a copy, then give it to Deformer::set_handles.
class HandleSet {
 public:
  /// Adds a handle or replaces the one of that name (regrouping). Errors, INVALID_ARGUMENT: HANDLE_NAME
  /// (empty or over 128 bytes), HANDLE_EMPTY, and what set_motion has. Whether vertices exist and belong to
  /// one handle only is checked by check_handles, when the whole set is known.
  absl::Status set(std::string_view name, Handle handle);

  /// Moves a handle. NOT_FOUND (HANDLE_UNKNOWN); INVALID_ARGUMENT: HANDLE_MOTION_NOT_FINITE,
  /// HANDLE_AXIS_ZERO, HANDLE_TARGET_COUNT (number of positions is not the number of vertices).
  absl::Status set_motion(std::string_view name, HandleMotion motion);

  /// False where there was none.
  bool remove(std::string_view name);

  const std::map<std::string, Handle, std::less<>>& handles() const { return handles_; }
  bool operator==(const HandleSet&) const = default;

 private:
  std::map<std::string, Handle, std::less<>> handles_;
};

/// INVALID_ARGUMENT: HANDLE_VERTEX_OUT_OF_RANGE, HANDLE_VERTEX_TWICE (in one handle or in two: both are
/// named).
absl::Status check_handles(const HandleSet& handles, std::int32_t vertex_count);

/// Where a handle's vertices go: rows in the order of handle.vertices.
Points target_positions(const Handle& handle, const Points& rest);

}  // namespace lpdeform
