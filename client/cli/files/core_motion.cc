#include "client/cli/files/core_motion.h"

#include <array>
#include <variant>

#include "client/cli/files/mesh_input.h"

namespace lpdeform::cli {
namespace {

Eigen::Vector3d vector_of(const std::array<double, 3>& numbers) {
  return {numbers[0], numbers[1], numbers[2]};
}

std::array<double, 3> array_of(const Eigen::Vector3d& vector) {
  return {vector[0], vector[1], vector[2]};
}

}  // namespace

HandleMotion to_core(const client::Motion& motion) {
  if (const auto* const rigid = std::get_if<client::RigidMotion>(&motion)) {
    return RigidMotion{vector_of(rigid->axis), rigid->angle_radians, vector_of(rigid->center),
                       vector_of(rigid->translation)};
  }
  if (const auto* const targets = std::get_if<client::TargetPositions>(&motion))
    return TargetPositions{points_of(targets->positions)};
  return Fixed{};
}

client::Motion to_client(const HandleMotion& motion) {
  if (const auto* const rigid = std::get_if<RigidMotion>(&motion)) {
    return client::RigidMotion{array_of(rigid->axis), rigid->angle_radians, array_of(rigid->center),
                               array_of(rigid->translation)};
  }
  if (const auto* const targets = std::get_if<TargetPositions>(&motion))
    return client::TargetPositions{flat(targets->positions)};
  return client::Fixed{};
}

}  // namespace lpdeform::cli
