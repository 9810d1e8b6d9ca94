#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/core/poses.h"

namespace lpdeform {

/// A creature of about `vertices` vertices.
inline TriangleMesh creature_of(double vertices) {
  const auto sample = static_cast<double>(creature(24).vertices.rows());
  return creature(static_cast<int>(24 * std::sqrt(vertices / sample)));
}

/// Holds the feet and turns the far end of the body.
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

/// Vertices to hold in addition: those within a twentieth of the body's length of a point on it.
inline std::vector<std::int32_t> creature_patch(const TriangleMesh& mesh, double share_of_length) {
  const Eigen::RowVector3d low = mesh.vertices.colwise().minCoeff();
  const Eigen::RowVector3d size = mesh.vertices.colwise().maxCoeff() - low;
  const Eigen::RowVector3d centre = low + Eigen::RowVector3d(share_of_length, 0.5, 0.75).cwiseProduct(size);
  Eigen::Index nearest;
  (mesh.vertices.rowwise() - centre).rowwise().squaredNorm().minCoeff(&nearest);
  std::vector<std::int32_t> result;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    if ((mesh.vertices.row(v) - mesh.vertices.row(nearest)).norm() < 0.05 * size[0])
      result.push_back(static_cast<std::int32_t>(v));
  }
  return result;
}

}  // namespace lpdeform
