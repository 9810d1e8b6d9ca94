#pragma once

#include "core/base/geometry.h"

namespace lpdeform {

/// A perspective camera whose picture holds a cloud of points with a margin.
///
/// The camera looks at the points' widest side, which is across the axis of their least extent, from a
/// quarter to the right and a little above. Up is z, or y if z is the axis of least extent.
class Camera {
 public:
  /// `points` must be finite, and at least one.
  Camera(const Points& points, int width, int height);

  /// Projects a point: pixels from the left, pixels from the top, and the inverse of its distance along the
  /// line of sight. Unlike the distance, the inverse is linear across the picture of a triangle.
  Eigen::RowVector3d project(const Eigen::RowVector3d& point) const;

  /// A direction in the camera's axes: right, up, towards the camera.
  Eigen::RowVector3d turn(const Eigen::RowVector3d& direction) const { return direction * axes_; }

  /// The direction from `point` to the camera, in the camera's axes, of length 1.
  Eigen::RowVector3d towards_camera(const Eigen::RowVector3d& point) const;

 private:
  Eigen::RowVector3d in_camera(const Eigen::RowVector3d& point) const { return (point - centre_) * axes_; }

  Eigen::RowVector3d centre_;
  Eigen::Matrix3d axes_;  // columns: right, up, towards the camera
  double distance_ = 1;   // of the camera from centre_
  double scale_ = 1;      // pixels for a slope of 1
  Eigen::RowVector2d shift_ = Eigen::RowVector2d::Zero();
};

}  // namespace lpdeform
