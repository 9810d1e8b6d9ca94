#pragma once

#include <array>

#include "lpdeform/v1/data.pb.h"

namespace lpdeform::client {

inline void put(const std::array<double, 3>& from, v1::Vector3* to) {
  to->set_x(from[0]);
  to->set_y(from[1]);
  to->set_z(from[2]);
}

inline std::array<double, 3> numbers_of(const v1::Vector3& vector) {
  return {vector.x(), vector.y(), vector.z()};
}

}  // namespace lpdeform::client
