#include "client/cli/render/camera.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace lpdeform {
namespace {

constexpr double kTurnRadians = 0.60, kRiseRadians = 0.38;
constexpr double kDistanceInRadii = 4.5;
constexpr double kMargin = 0.08,
                 kBottomMargin = 0.12;  // of the picture's width and height; a legend needs room

struct Axes {
  int facing;  // across the widest side
  int up;
  double sign;  // the side of `facing` from which the camera looks
};

Axes choose_axes(const Eigen::RowVector3d& extent) {
  Eigen::Index thinnest = 0;
  extent.minCoeff(&thinnest);
  if (thinnest == 2) return {2, 1, 1};
  if (thinnest == 1) return {1, 2, -1};
  return {0, 2, 1};
}

Eigen::Matrix3d camera_axes(const Eigen::RowVector3d& extent) {
  const Axes axes = choose_axes(extent);
  const Eigen::Vector3d facing = axes.sign * Eigen::Vector3d::Unit(axes.facing),
                        up = Eigen::Vector3d::Unit(axes.up);
  const Eigen::Vector3d right = up.cross(facing);
  const Eigen::Vector3d level = std::cos(kTurnRadians) * facing + std::sin(kTurnRadians) * right;
  Eigen::Matrix3d result;
  result.col(2) = std::cos(kRiseRadians) * level + std::sin(kRiseRadians) * up;
  result.col(0) = up.cross(result.col(2)).normalized();
  result.col(1) = result.col(2).cross(result.col(0));
  return result;
}

}  // namespace

Camera::Camera(const Points& points, int width, int height) {
  const Eigen::RowVector3d low = points.colwise().minCoeff(), high = points.colwise().maxCoeff();
  centre_ = low / 2 + high / 2;
  axes_ = camera_axes(high - low);
  const double radius = (points.rowwise() - centre_).rowwise().norm().maxCoeff();
  distance_ = kDistanceInRadii * std::max(radius, std::numeric_limits<double>::min());

  Eigen::RowVector2d left_bottom = Eigen::RowVector2d::Constant(std::numeric_limits<double>::max());
  Eigen::RowVector2d right_top = -left_bottom;
  for (const auto& point : points.rowwise()) {
    const Eigen::RowVector3d local = in_camera(point);
    const Eigen::RowVector2d slope = local.head<2>() / (distance_ - local[2]);
    left_bottom = left_bottom.cwiseMin(slope);
    right_top = right_top.cwiseMax(slope);
  }
  const Eigen::RowVector2d room((1 - 2 * kMargin) * width, (1 - kMargin - kBottomMargin) * height);
  const Eigen::RowVector2d size = (right_top - left_bottom).cwiseMax(1e-9);
  scale_ = room.cwiseQuotient(size).minCoeff();
  const Eigen::RowVector2d middle = (left_bottom + right_top) / 2;
  shift_ = Eigen::RowVector2d(0.5 * width - scale_ * middle[0],
                              kMargin * height + 0.5 * room[1] + scale_ * middle[1]);
}

Eigen::RowVector3d Camera::project(const Eigen::RowVector3d& point) const {
  const Eigen::RowVector3d local = in_camera(point);
  const double depth = distance_ - local[2];
  return {shift_[0] + scale_ * local[0] / depth, shift_[1] - scale_ * local[1] / depth, distance_ / depth};
}

Eigen::RowVector3d Camera::towards_camera(const Eigen::RowVector3d& point) const {
  return (Eigen::RowVector3d(0, 0, distance_) - in_camera(point)).normalized();
}

}  // namespace lpdeform
