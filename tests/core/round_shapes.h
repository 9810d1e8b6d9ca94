#pragma once

#include <cmath>
#include <numbers>
#include <random>

#include "core/mesh/mesh.h"

namespace lpdeform {

/// A unit sphere with poles on the z axis and `rows` bands of `around` faces or pairs of faces. around >= 3, rows >= 2.
inline TriangleMesh ball_with_poles(int around, int rows) {
  const int last = around * (rows - 1) + 1;
  TriangleMesh mesh{Points(last + 1, 3), Faces(2 * around * (rows - 1), 3)};
  mesh.vertices.row(0) << 0, 0, 1;
  mesh.vertices.row(last) << 0, 0, -1;
  const auto at = [&](int row, int k) {
    return row == 0 ? 0 : row == rows ? last : 1 + (row - 1) * around + k % around;
  };
  Eigen::Index face = 0;
  for (int row = 0; row < rows; ++row) {
    const double down = std::numbers::pi * row / rows;
    for (int k = 0; k < around; ++k) {
      const double turn = 2 * std::numbers::pi * k / around;
      if (row > 0)
        mesh.vertices.row(at(row, k)) << std::sin(down) * std::cos(turn), std::sin(down) * std::sin(turn),
            std::cos(down);
      if (row > 0) mesh.faces.row(face++) << at(row, k), at(row + 1, k), at(row, k + 1);
      if (row + 1 < rows) mesh.faces.row(face++) << at(row, k + 1), at(row + 1, k), at(row + 1, k + 1);
    }
  }
  return mesh;
}

/// The points with random distances from the origin, with a standard deviation of `share`; deterministic.
inline Points with_noisy_radii(const Points& points, double share) {
  std::mt19937 random(11);
  std::normal_distribution<double> factor(1, share);
  Points result = points;
  for (Eigen::Index i = 0; i < result.rows() && share > 0; ++i) result.row(i) *= factor(random);
  return result;
}

}  // namespace lpdeform
