#pragma once

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/base/geometry.h"

namespace lpdeform {

/// A scaling by different factors along three axes: x -> origin + sum_k scale_k u_k u_k^T (x - origin).
struct Scaling {
  /// 0.01 <= scale_k <= 100.
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  /// In the caller's units.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  /// u_k: rows, orthonormal.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();

  Points operator()(const Points& points) const;

  static constexpr double kLowest = 0.01, kHighest = 100;
};

/// Orthonormal axes from two directions of any length: the first direction, the part of the second that is
/// perpendicular to it, and their cross product. INVALID_ARGUMENT: RESIZE_AXES if they are not finite, have length 0,
/// or are too nearly parallel (a sine of at most 1e-6).
absl::StatusOr<Eigen::Matrix3d> axes_of(const Eigen::Vector3d& x_axis, const Eigen::Vector3d& y_axis);

/// INVALID_ARGUMENT: RESIZE_SCALE_OUT_OF_RANGE, RESIZE_ORIGIN_NOT_FINITE.
absl::Status check_scaling(const Scaling& scaling);

/// |log scale_k| / max_j |log scale_j|; (1, 0, 0) if all scales are 1.
Eigen::Vector3d stretch_shares(const Eigen::Vector3d& scale);

}  // namespace lpdeform
