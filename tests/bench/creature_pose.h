#pragma once

#include <algorithm>
#include <cmath>

#include "tests/core/poses.h"

namespace lpdeform {

/// A creature of about `vertices` vertices.
inline TriangleMesh creature_of(double vertices) {
  const auto sample = static_cast<double>(creature(24).vertices.rows());
  return creature(static_cast<int>(24 * std::sqrt(vertices / sample)));
}

/// Its feet stay, the far end of its body is turned.
inline HandleSet creature_turn(const TriangleMesh& mesh) {
  const Eigen::RowVector3d low = mesh.vertices.colwise().minCoeff();
  const Eigen::RowVector3d size = mesh.vertices.colwise().maxCoeff() - low;
  const std::vector<std::int32_t> feet = slice(mesh, 2, low[2], low[2] + 0.05 * size[2]);
  std::vector<std::int32_t> head;
  for (const std::int32_t v : slice(mesh, 0, low[0] + 0.92 * size[0], 1e9)) {
    if (!std::binary_search(feet.begin(), feet.end(), v)) head.push_back(v);
  }
  HandleSet handles;
  (void)handles.set("feet", {feet, Fixed{}});
  (void)handles.set("head", {head, turn(Eigen::Vector3d::UnitY(), 50, (low + 0.7 * size).transpose())});
  return handles;
}

}  // namespace lpdeform
