#include "core/solve/handles.h"

#include <Eigen/Geometry>
#include <cmath>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"

namespace lpdeform {
namespace {

constexpr std::size_t kLongestName = 128;

std::string quoted(std::string_view name) {
  return absl::StrCat("handle \"", std::string(name), "\"");
}

absl::Status not_finite(std::string_view name, const std::string& what) {
  return invalid_input({"HANDLE_MOTION_NOT_FINITE", quoted(name), "finite numbers"},
                       absl::StrCat(what, " of ", quoted(name), " is not finite"));
}

absl::Status check_rigid(std::string_view name, const RigidMotion& motion) {
  if (!motion.axis.allFinite()) return not_finite(name, "the rotation axis");
  if (!std::isfinite(motion.angle_radians)) return not_finite(name, "the rotation angle");
  if (!motion.center.allFinite()) return not_finite(name, "the rotation centre");
  if (!motion.translation.allFinite()) return not_finite(name, "the translation");
  if (motion.angle_radians != 0 && !(motion.axis.stableNorm() > 0)) {
    return invalid_input(
        {"HANDLE_AXIS_ZERO", quoted(name), "|axis| > 0"},
        absl::StrCat(quoted(name), " turns by ", motion.angle_radians, " radians about an axis of length 0"));
  }
  return absl::OkStatus();
}

absl::Status check_targets(std::string_view name, const Handle& handle, const TargetPositions& targets) {
  const auto count = static_cast<Eigen::Index>(handle.vertices.size());
  if (targets.positions.rows() != count) {
    return invalid_input({"HANDLE_TARGET_COUNT", quoted(name), absl::StrCat(count, " positions")},
                         absl::StrCat(quoted(name), " has ", count, " vertices and ",
                                      targets.positions.rows(), " target positions"));
  }
  for (Eigen::Index row = 0; row < count; ++row) {
    if (!targets.positions.row(row).allFinite())
      return not_finite(name, absl::StrCat("target position ", row));
  }
  return absl::OkStatus();
}

absl::Status check_motion(std::string_view name, const Handle& handle, const HandleMotion& motion) {
  if (const auto* rigid = std::get_if<RigidMotion>(&motion)) return check_rigid(name, *rigid);
  if (const auto* targets = std::get_if<TargetPositions>(&motion))
    return check_targets(name, handle, *targets);
  return absl::OkStatus();
}

}  // namespace

bool TargetPositions::operator==(const TargetPositions& other) const {
  return positions.rows() == other.positions.rows() && positions == other.positions;
}

absl::Status HandleSet::set(std::string_view name, Handle handle) {
  if (name.empty() || name.size() > kLongestName) {
    return invalid_input({"HANDLE_NAME", quoted(name.substr(0, kLongestName)), "1 to 128 bytes"},
                         absl::StrCat("a handle's name has ", name.size(), " bytes; it must have 1 to 128"));
  }
  if (handle.vertices.empty()) {
    return invalid_input({"HANDLE_EMPTY", quoted(name), "at least 1 vertex"},
                         absl::StrCat(quoted(name), " has no vertices; it needs at least one"));
  }
  if (absl::Status status = check_motion(name, handle, handle.motion); !status.ok()) return status;
  handles_.insert_or_assign(std::string(name), std::move(handle));
  return absl::OkStatus();
}

absl::Status HandleSet::set_motion(std::string_view name, HandleMotion motion) {
  const auto found = handles_.find(name);
  if (found == handles_.end()) {
    return make_fault(absl::StatusCode::kNotFound, {"HANDLE_UNKNOWN", quoted(name), ""},
                      absl::StrCat("there is no ", quoted(name)));
  }
  if (absl::Status status = check_motion(name, found->second, motion); !status.ok()) return status;
  found->second.motion = std::move(motion);
  return absl::OkStatus();
}

bool HandleSet::remove(std::string_view name) {
  const auto found = handles_.find(name);
  if (found == handles_.end()) return false;
  handles_.erase(found);
  return true;
}

absl::Status check_handles(const HandleSet& handles, std::int32_t vertex_count) {
  std::unordered_map<std::int32_t, std::string_view> owner;
  for (const auto& [name, handle] : handles.handles()) {
    for (const std::int32_t vertex : handle.vertices) {
      const std::string element = absl::StrCat("vertex ", vertex);
      if (vertex < 0 || vertex >= vertex_count) {
        return invalid_input(
            {"HANDLE_VERTEX_OUT_OF_RANGE", element, absl::StrCat("0 <= vertex < ", vertex_count)},
            absl::StrCat(quoted(name), " holds vertex ", vertex, "; the mesh has ", vertex_count,
                         " vertices, 0 to ", vertex_count - 1));
      }
      const auto [entry, is_new] = owner.emplace(vertex, name);
      if (is_new) continue;
      const std::string where = entry->second == name
                                    ? absl::StrCat("twice in ", quoted(name))
                                    : absl::StrCat("in ", quoted(entry->second), " and in ", quoted(name));
      return invalid_input({"HANDLE_VERTEX_TWICE", element, "one handle a vertex"},
                           absl::StrCat("vertex ", vertex, " is ", where));
    }
  }
  return absl::OkStatus();
}

Points target_positions(const Handle& handle, const Points& rest) {
  if (const auto* targets = std::get_if<TargetPositions>(&handle.motion)) return targets->positions;
  Points result(handle.vertices.size(), 3);
  for (std::size_t k = 0; k < handle.vertices.size(); ++k) result.row(k) = rest.row(handle.vertices[k]);
  if (const auto* rigid = std::get_if<RigidMotion>(&handle.motion)) {
    if (rigid->angle_radians != 0) {
      const Eigen::AngleAxisd turn(rigid->angle_radians, rigid->axis.stableNormalized());
      const Eigen::RowVector3d center = rigid->center.transpose();
      result = ((result.rowwise() - center) * turn.toRotationMatrix().transpose()).rowwise() + center;
    }
    result.rowwise() += rigid->translation.transpose();
  }
  return result;
}

}  // namespace lpdeform
