#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <variant>

#include "absl/status/status.h"
#include "core/base/geometry.h"

namespace lpdeform {

/// A point inside a face of the rest mesh, sum_c barycentric[c] * (corner c of the face). Coordinates are at
/// least 0 and add up to 1, both to 1e-6.
struct SurfacePoint {
  std::int32_t face = 0;
  Eigen::Vector3d barycentric = Eigen::Vector3d::Constant(1.0 / 3);

  bool operator==(const SurfacePoint&) const = default;
};

// How a handle holds its vertices or points. The target of a vertex or point is the place to which the handle's motion
// moves it.

/// Held exactly at its target.
struct Exactly {
  bool operator==(const Exactly&) const = default;
};

/// Pulled to its target: each vertex or point adds a soft term (SoftTerms) with D^2 = weight |x - target|^2. Weight 0
/// releases it, 1 is about as strong as one edge of the surface; in [0, 1e6].
struct Soft {
  double weight = 1;

  bool operator==(const Soft&) const = default;
};

/// Prescribes a rotation and leaves the position free: the cells of the handle's vertices should have the rotation R of
/// its motion. Each vertex adds a soft term with D^2 = weight sum_j w_ij |(x_i - x_j) - R (p_i - p_j)|^2. Weight in [0,
/// 1e6]. For vertices only.
struct Orientation {
  double weight = 100;

  bool operator==(const Orientation&) const = default;
};

/// Free to move along the line through its target in direction `axis` (any length but 0); held exactly across it. For
/// vertices only.
struct AxisLock {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();

  bool operator==(const AxisLock&) const = default;
};

/// Free to move in the plane through its target with normal `normal` (any length but 0); held exactly along the normal.
/// For vertices only.
struct PlaneLock {
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();

  bool operator==(const PlaneLock&) const = default;
};

using Hold = std::variant<Exactly, Soft, Orientation, AxisLock, PlaneLock>;

inline constexpr double kHighestSoftWeight = 1e6;

/// Whether this kind can hold points inside faces as well as vertices.
bool takes_points(const Hold& hold);

/// Whether the handle's motion may be target positions. If not, the motion is fixed or rigid.
bool takes_positions(const Hold& hold);

/// The hold for `fewer` vertices that represent `count` vertices, as on a coarse level. A soft weight is multiplied by
/// count / fewer, up to kHighestSoftWeight; everything else stays the same.
Hold hold_on_fewer(const Hold& hold, std::size_t count, std::size_t fewer);

/// Checks the numbers of a hold; `name` is the handle's. INVALID_ARGUMENT: HANDLE_WEIGHT_OUT_OF_RANGE,
/// HANDLE_LOCK_DIRECTION.
absl::Status check_hold(std::string_view name, const Hold& hold);

}  // namespace lpdeform
