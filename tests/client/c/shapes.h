#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "client/c/lpdeform.h"

namespace lpdeform::engine {

// Meshes and targets for tests of the C interface.

using Point = std::array<float, 3>;

/// For arrays that outlive the mesh.
inline lpdeform_mesh mesh_of(const std::vector<Point>& points, const std::vector<std::uint32_t>& indices) {
  lpdeform_mesh out{};
  out.struct_size = sizeof out;
  out.vertex_count = static_cast<std::uint32_t>(points.size());
  out.positions = {points.data(), points.size() * sizeof(Point), 0, 0, LPDEFORM_FLOAT32, 0};
  out.indices = indices.data();
  out.index_count = static_cast<std::uint32_t>(indices.size());
  return out;
}

/// The smallest mesh that can be deformed.
struct Triangle {
  lpdeform_mesh mesh() const { return mesh_of(points, indices); }

  std::vector<Point> points{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  std::vector<std::uint32_t> indices{0, 1, 2};
};

inline lpdeform_buffers buffers_of(std::vector<Point>& points) {
  lpdeform_buffers out{};
  out.struct_size = sizeof out;
  out.positions = {points.data(), points.size() * sizeof(Point), 0, 0, LPDEFORM_FLOAT32, 0};
  return out;
}

/// A strip in the plane y = 0, ten cells long in x and one wide in z; up and counter-clockwise seen from above, in the server's
/// coordinates.
struct Strip {
  Strip() {
    for (int k = 0; k <= 10; ++k) {
      points.push_back({float(k), 0, 1});
      points.push_back({float(k), 0, 0});
    }
    for (std::uint32_t k = 0; k < 20; k += 2) {
      for (const std::uint32_t corner : {0U, 2U, 3U, 0U, 3U, 1U}) indices.push_back(k + corner);
    }
  }

  lpdeform_mesh mesh() const { return mesh_of(points, indices); }

  std::vector<Point> points;
  std::vector<std::uint32_t> indices;
};

}  // namespace lpdeform::engine
