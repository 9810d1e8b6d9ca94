#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>
#include <string_view>
#include <vector>

#include "tests/bench/creature_pose.h"

namespace lpdeform {

/// A mesh of a family with about `vertices` vertices.
inline TriangleMesh family_of(std::string_view family, double vertices) {
  const auto scaled = [&](TriangleMesh (*make)(int), int resolution) {
    const auto sample = static_cast<double>(make(resolution).vertices.rows());
    return make(static_cast<int>(resolution * std::sqrt(vertices / sample)));
  };
  if (family == "scan") return scaled(scan, 40);
  if (family == "tree") return scaled(tube_tree, 96);
  if (family == "sheet") {
    const double side = std::sqrt(vertices / 4.2);  // 2 x 30 x 60 cells have 3,962 vertices
    const int thin = std::max(1, static_cast<int>(side / 15));
    return box_surface(thin, static_cast<int>(side), static_cast<int>(2 * side));
  }
  return creature_of(vertices);
}

/// Pose number k of a mesh, the same at every resolution but for the grain of the mesh: the vertices within a tenth of
/// the diagonal of a point are held, and those around the vertex farthest from it are turned by 20 to 110 degrees about an
/// axis through them and moved by up to 0.2 diagonals. Every second pose has a third patch, which stays or moves.
inline HandleSet family_pose(const TriangleMesh& mesh, unsigned number) {
  std::mt19937_64 random(number * 7919 + 17);
  const auto uniform = [&random] { return static_cast<double>(random() >> 11) * 0x1p-53; };
  const Eigen::RowVector3d low = mesh.vertices.colwise().minCoeff(),
                           high = mesh.vertices.colwise().maxCoeff();
  const double diagonal = (high - low).norm();
  const auto direction = [&]() -> Eigen::RowVector3d {
    const double z = 2 * uniform() - 1, angle = 2 * std::numbers::pi * uniform();
    return {std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle), z};
  };
  std::vector<char> is_taken(static_cast<std::size_t>(mesh.vertices.rows()), 0);
  const auto patch = [&](const Eigen::RowVector3d& centre, double radius) {
    std::vector<std::int32_t> found;
    for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
      if (is_taken[v] != 0 || (mesh.vertices.row(v) - centre).norm() > radius * diagonal) continue;
      is_taken[v] = 1;
      found.push_back(static_cast<std::int32_t>(v));
    }
    return found;
  };
  const auto extreme = [&](const Eigen::RowVector3d& way) -> Eigen::RowVector3d {
    Eigen::Index best;
    (mesh.vertices * way.transpose()).maxCoeff(&best);
    return mesh.vertices.row(best);
  };
  const auto farthest = [&](const Eigen::RowVector3d& from) -> Eigen::RowVector3d {
    Eigen::Index best;
    (mesh.vertices.rowwise() - from).rowwise().squaredNorm().maxCoeff(&best);
    return mesh.vertices.row(best);
  };
  const auto motion = [&](const Eigen::RowVector3d& centre, double most) {
    return RigidMotion{direction().transpose(), (0.18 + most * uniform()) * std::numbers::pi / 1.0 * 0.6,
                       centre.transpose(), 0.2 * most * uniform() * diagonal * direction().transpose()};
  };
  const Eigen::RowVector3d first = extreme(direction()), second = farthest(first);
  HandleSet handles;
  (void)handles.set("held", {patch(first, 0.1), Fixed{}});
  (void)handles.set("moved", {patch(second, 0.08), motion(second, 1)});
  if (number % 2 == 1) {
    const Eigen::RowVector3d third = extreme(direction());
    std::vector<std::int32_t> vertices = patch(third, 0.05);
    if (!vertices.empty()) (void)handles.set("third", {std::move(vertices), motion(third, 0.3)});
  }
  return handles;
}

}  // namespace lpdeform
