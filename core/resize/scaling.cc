#include "core/resize/scaling.h"

#include <Eigen/Geometry>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

constexpr double kSmallestSine = 1e-6;

}  // namespace

absl::Status check_scaling(const Scaling& scaling) {
  for (int k = 0; k < 3; ++k) {
    const double scale = scaling.scale[k];
    if (scale >= Scaling::kLowest && scale <= Scaling::kHighest) continue;
    return make_fault(
        {Reason::kResizeScaleOutOfRange, absl::StrCat("scale[", k, "]"), "0.01 <= scale <= 100"},
        absl::StrCat("scale[", k, "] is ", scale, "; it must be from 0.01 to 100"));
  }
  if (scaling.origin.allFinite()) return absl::OkStatus();
  return make_fault({Reason::kResizeOriginNotFinite, "origin", "finite numbers"},
                    "the origin of the resizing is not finite");
}

Points Scaling::operator()(const Points& points) const {
  const Eigen::Matrix3d matrix = axes.transpose() * scale.asDiagonal() * axes;
  return ((points.rowwise() - origin.transpose()) * matrix).rowwise() + origin.transpose();
}

absl::StatusOr<Eigen::Matrix3d> axes_of(const Eigen::Vector3d& x_axis, const Eigen::Vector3d& y_axis) {
  const Eigen::Vector3d x = x_axis.stableNormalized(), y = y_axis.stableNormalized();
  const Eigen::Vector3d across = y - y.dot(x) * x;
  const bool is_finite = x_axis.allFinite() && y_axis.allFinite();
  if (!is_finite || !(x.norm() > 0.5) || !(across.norm() > kSmallestSine)) {
    return make_fault({Reason::kResizeAxes, "axes", "two directions that are not parallel"},
                      "the axes of the resizing are not finite, of length 0, or parallel");
  }
  Eigen::Matrix3d axes;
  axes.row(0) = x;
  axes.row(1) = across.normalized();
  axes.row(2) = axes.row(0).cross(axes.row(1));
  return axes;
}

Eigen::Vector3d stretch_shares(const Eigen::Vector3d& scale) {
  const Eigen::Vector3d stretch = scale.array().log().abs();
  const double largest = stretch.maxCoeff();
  return largest > 0 ? Eigen::Vector3d(stretch / largest) : Eigen::Vector3d(1, 0, 0);
}

}  // namespace lpdeform
