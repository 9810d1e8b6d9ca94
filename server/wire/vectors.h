#pragma once

#include "core/base/geometry.h"
#include "lpdeform/v1/data.pb.h"

namespace lpdeform {

inline Eigen::Vector3d decode_vector(const v1::Vector3& message) {
  return {message.x(), message.y(), message.z()};
}

inline void encode_vector(const Eigen::Vector3d& vector, v1::Vector3& out) {
  out.set_x(vector.x());
  out.set_y(vector.y());
  out.set_z(vector.z());
}

}  // namespace lpdeform
