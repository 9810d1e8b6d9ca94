#pragma once

#include <array>
#include <span>

#include "absl/status/statusor.h"
#include "client/c/lpdeform.h"

namespace lpdeform::engine {

using Vector = std::array<double, 3>;

/// Converts between the coordinates of an engine and the server's: right-handed, y up, metres, counter-clockwise. Each
/// of the server's axes is one of the engine's axes, with the same or the opposite sign, so only the unit of length
/// causes rounding.
class Space {
 public:
  /// ENUM_UNKNOWN; UNITS_OUT_OF_RANGE if units_per_metre is negative or not finite.
  static absl::StatusOr<Space> of(const lpdeform_options& options);

  Vector point_to_server(const Vector& point) const;
  Vector point_to_engine(const Vector& point) const;
  Vector direction_to_server(const Vector& direction) const;
  Vector direction_to_engine(const Vector& direction) const;
  /// Converts the axis of a rotation. Its sign changes if the handedness differs.
  Vector rotation_axis_to_server(const Vector& axis) const;
  double length_to_server(double length) const { return length / units_per_metre_; }
  /// Whether the corners of each triangle are reordered, so that its outside stays the same.
  bool turns_triangles() const { return turns_triangles_; }

  // For loops over vertices: engine[axis[k]] = factor[k] * server[k].
  const std::array<int, 3>& axis() const { return axis_; }
  const std::array<double, 3>& sign() const { return sign_; }
  double units_per_metre() const { return units_per_metre_; }

 private:
  std::array<int, 3> axis_ = {0, 1, 2};  // server axis k is the engine's axis_[k] times sign_[k]
  std::array<double, 3> sign_ = {1, 1, 1};
  double units_per_metre_ = 1;
  bool mirrors_ = false;
  bool turns_triangles_ = false;
};

}  // namespace lpdeform::engine
