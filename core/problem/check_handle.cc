#include "core/problem/check_handle.h"

#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/problem/handle_name.h"

namespace lpdeform {
namespace {

constexpr double kBarycentricSlack = 1e-6;

absl::Status not_finite(std::string_view name, const std::string& what) {
  return make_fault({Reason::kHandleMotionNotFinite, handle_element(name), "finite numbers"},
                    absl::StrCat(what, " of ", handle_element(name), " is not finite"));
}

absl::Status check_rigid(std::string_view name, const RigidMotion& motion) {
  if (!motion.axis.allFinite()) return not_finite(name, "the rotation axis");
  if (!std::isfinite(motion.angle_radians)) return not_finite(name, "the rotation angle");
  if (!motion.center.allFinite()) return not_finite(name, "the rotation centre");
  if (!motion.translation.allFinite()) return not_finite(name, "the translation");
  if (motion.angle_radians != 0 && !(motion.axis.stableNorm() > 0)) {
    return make_fault({Reason::kHandleAxisZero, handle_element(name), "|axis| > 0"},
                      absl::StrCat(handle_element(name), " turns by ", motion.angle_radians,
                                   " radians about an axis of length 0"));
  }
  return absl::OkStatus();
}

absl::Status check_targets(std::string_view name, const Handle& handle, const TargetPositions& targets) {
  const auto count = static_cast<Eigen::Index>(handle.size());
  if (targets.positions.rows() != count) {
    return make_fault({Reason::kHandleTargetCount, handle_element(name), absl::StrCat(count, " positions")},
                      absl::StrCat(handle_element(name), " has ", count,
                                   handle.points.empty() ? " vertices and " : " points and ",
                                   targets.positions.rows(), " target positions"));
  }
  for (Eigen::Index row = 0; row < count; ++row) {
    if (!targets.positions.row(row).allFinite())
      return not_finite(name, absl::StrCat("target position ", row));
  }
  return absl::OkStatus();
}

absl::Status check_points(std::string_view name, const Handle& handle) {
  if (!takes_points(handle.hold)) {
    return make_fault(
        {Reason::kHandleKindNeedsVertices, handle_element(name), "vertices"},
        absl::StrCat(handle_element(name), " has points inside faces, but its kind takes vertices only"));
  }
  for (std::size_t k = 0; k < handle.points.size(); ++k) {
    const Eigen::Vector3d& b = handle.points[k].barycentric;
    if (b.minCoeff() >= -kBarycentricSlack && std::abs(b.sum() - 1) <= kBarycentricSlack) continue;
    return make_fault(
        {Reason::kHandleBarycentric, absl::StrCat(handle_element(name), " point ", k),
         "each >= 0, sum = 1, to 1e-6"},
        absl::StrCat("the barycentric coordinates of point ", k, " of ", handle_element(name), " are ", b[0],
                     ", ", b[1], ", ", b[2], "; they must be 0 or more and add up to 1"));
  }
  return absl::OkStatus();
}

absl::Status check_members(std::string_view name, const Handle& handle) {
  if (handle.size() == 0) {
    return make_fault({Reason::kHandleEmpty, handle_element(name), "at least 1 vertex or point"},
                      absl::StrCat(handle_element(name), " has no vertices; it needs at least one"));
  }
  if (!handle.vertices.empty() && !handle.points.empty()) {
    return make_fault(
        {Reason::kHandlePointsAndVertices, handle_element(name), "vertices or points"},
        absl::StrCat(handle_element(name), " has vertices and points inside faces; it takes one of the two"));
  }
  return handle.points.empty() ? absl::OkStatus() : check_points(name, handle);
}

absl::Status check_footprint(std::string_view name, double radius) {
  if (radius >= 0 && std::isfinite(radius)) return absl::OkStatus();
  return make_fault(
      {Reason::kHandleFootprintOutOfRange, handle_element(name), "0 <= footprint < infinity"},
      absl::StrCat("the footprint of ", handle_element(name), " is ", radius, "; it must be 0 or a length"));
}

}  // namespace

absl::Status no_handles() {
  return make_fault({Reason::kNoHandles, "", "at least 1 handle"},
                    "there is no handle; a deformation needs at least one");
}

absl::Status check_handle(std::string_view name, const Handle& handle) {
  absl::Status status = check_handle_name(name);
  if (status.ok()) status = check_members(name, handle);
  if (status.ok()) status = check_hold(name, handle.hold);
  if (status.ok()) status = check_footprint(name, handle.footprint);
  return status.ok() ? check_motion(name, handle, handle.motion) : status;
}

absl::Status check_motion(std::string_view name, const Handle& handle, const HandleMotion& motion) {
  if (const auto* rigid = std::get_if<RigidMotion>(&motion)) return check_rigid(name, *rigid);
  const auto* targets = std::get_if<TargetPositions>(&motion);
  if (targets == nullptr) return absl::OkStatus();
  if (!takes_positions(handle.hold)) {
    return make_fault({Reason::kHandleKindNeedsRotation, handle_element(name), "fixed or rigid motion"},
                      absl::StrCat(handle_element(name), " prescribes a rotation and takes no positions"));
  }
  return check_targets(name, handle, *targets);
}

}  // namespace lpdeform
