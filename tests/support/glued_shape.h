#pragma once

#include <algorithm>
#include <array>
#include <numeric>
#include <random>
#include <vector>

#include "core/mesh/mesh.h"

namespace lpdeform {

/// A manifold with boundary that is not near any plane: patches of 4 x 4 squares whose right and upper edges are glued at random to
/// the left and lower edges of others. It has 16 vertices per patch. Every factorisation of it fills in, with about n^2 / 20
/// entries.
inline TriangleMesh glued_at_random(std::int32_t patches) {
  constexpr std::int32_t kSide = 4;
  std::mt19937 random(3);
  const auto shuffled = [&] {
    std::vector<std::int32_t> order(static_cast<std::size_t>(patches));
    std::iota(order.begin(), order.end(), 0);
    std::shuffle(order.begin(), order.end(), random);
    return order;
  };
  const std::vector<std::int32_t> right = shuffled(), upper = shuffled();
  const auto at = [&](std::int32_t patch, std::int32_t i, std::int32_t j) {
    if (i == kSide) patch = right[static_cast<std::size_t>(patch)], i = 0;
    if (j == kSide) patch = upper[static_cast<std::size_t>(patch)], j = 0;
    return (patch * kSide + i) * kSide + j;
  };
  std::vector<std::array<std::int32_t, 3>> faces;
  for (std::int32_t patch = 0; patch < patches; ++patch) {
    for (std::int32_t i = 0; i < kSide; ++i) {
      for (std::int32_t j = 0; j < kSide; ++j) {
        if (i == kSide - 1 && j == kSide - 1) continue;  // where both seams cross there is a hole
        const std::int32_t a = at(patch, i, j), b = at(patch, i + 1, j), c = at(patch, i + 1, j + 1),
                           d = at(patch, i, j + 1);
        faces.push_back({a, b, c});
        faces.push_back({a, c, d});
      }
    }
  }
  TriangleMesh mesh;
  mesh.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k)
      mesh.faces(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(k)) = faces[f][k];
  }
  std::normal_distribution<double> place;
  mesh.vertices.resize(static_cast<Eigen::Index>(patches) * kSide * kSide, 3);
  for (double& x : mesh.vertices.reshaped()) x = place(random);
  return mesh;
}

}  // namespace lpdeform
