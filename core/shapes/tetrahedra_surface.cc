#include "core/shapes/tetrahedra_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/hash_map.h"

namespace lpdeform {
namespace {

using Triangle = std::array<std::int32_t, 3>;

/// The corners of a cube are numbered by bits: 1 for x, 2 for y, 4 for z. The corners of each tetrahedron lead from 0
/// to 7.
constexpr std::array<std::array<int, 4>, 6> kTetrahedra{
    {{0, 1, 3, 7}, {0, 1, 5, 7}, {0, 2, 3, 7}, {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 6, 7}}};

class Marcher {
 public:
  Marcher(const ImplicitField& field, const SampleGrid& grid)
      : grid_(grid), step_y_(grid.cells[0] + 1), step_z_(step_y_ * (grid.cells[1] + 1)) {
    values_.reserve(step_z_ * (grid.cells[2] + 1));
    for (std::int64_t sample = 0; sample < step_z_ * (grid.cells[2] + 1); ++sample) {
      values_.push_back(field(position(sample)));
    }
  }

  TriangleMesh surface() {
    for (std::int64_t z = 0; z < grid_.cells[2]; ++z) {
      for (std::int64_t y = 0; y < grid_.cells[1]; ++y) {
        for (std::int64_t x = 0; x < grid_.cells[0]; ++x) cut_cube(x + step_y_ * y + step_z_ * z);
      }
    }
    TriangleMesh mesh;
    mesh.vertices.resize(static_cast<Eigen::Index>(points_.size()), 3);
    for (std::size_t v = 0; v < points_.size(); ++v) mesh.vertices.row(v) = points_[v];
    mesh.faces.resize(static_cast<Eigen::Index>(triangles_.size()), 3);
    for (std::size_t f = 0; f < triangles_.size(); ++f) {
      for (int corner = 0; corner < 3; ++corner) mesh.faces(f, corner) = triangles_[f][corner];
    }
    return mesh;
  }

 private:
  Eigen::RowVector3d position(std::int64_t sample) const {
    const std::int64_t x = sample % step_y_, y = sample % step_z_ / step_y_, z = sample / step_z_;
    return grid_.origin + grid_.spacing * Eigen::RowVector3d(x, y, z);
  }

  bool is_inside(std::int64_t sample) const { return values_[sample] < 0; }

  void cut_cube(std::int64_t lowest) {
    std::array<std::int64_t, 8> samples;
    int inside = 0;
    for (int corner = 0; corner < 8; ++corner) {
      samples[corner] = lowest + (corner & 1) + (corner >> 1 & 1) * step_y_ + (corner >> 2) * step_z_;
      inside += is_inside(samples[corner]) ? 1 : 0;
    }
    if (inside == 0 || inside == 8) return;
    for (const std::array<int, 4>& tetrahedron : kTetrahedra) {
      std::array<std::int64_t, 4> corners;
      for (int k = 0; k < 4; ++k) corners[k] = samples[tetrahedron[k]];
      cut_tetrahedron(corners);
    }
  }

  void cut_tetrahedron(std::array<std::int64_t, 4> corners) {
    const auto middle = std::stable_partition(corners.begin(), corners.end(),
                                              [&](std::int64_t sample) { return is_inside(sample); });
    const auto [a, b, c, d] = corners;
    switch (middle - corners.begin()) {
      case 1:
        return add_triangle({{{a, b}, {a, c}, {a, d}}});
      case 2:
        add_triangle({{{a, c}, {a, d}, {b, d}}});
        return add_triangle({{{a, c}, {b, d}, {b, c}}});
      case 3:
        return add_triangle({{{a, d}, {b, d}, {c, d}}});
      default:
        return;
    }
  }

  using Edge = std::pair<std::int64_t, std::int64_t>;  // inside, outside

  /// Adds a triangle, oriented outwards. The midpoints of the edges decide the orientation, because the cuts themselves
  /// may be collinear.
  void add_triangle(const std::array<Edge, 3>& edges) {
    std::array<Eigen::RowVector3d, 3> middles;
    for (int k = 0; k < 3; ++k) middles[k] = (position(edges[k].first) + position(edges[k].second)) / 2;
    const Eigen::RowVector3d normal = (middles[1] - middles[0]).cross(middles[2] - middles[0]);
    Triangle triangle{cut(edges[0]), cut(edges[1]), cut(edges[2])};
    if (normal.dot(position(edges[0].second) - position(edges[0].first)) < 0)
      std::swap(triangle[1], triangle[2]);
    triangles_.push_back(triangle);
  }

  /// The vertex at which the surface cuts an edge.
  std::int32_t cut(const Edge& edge) {
    const auto [entry, is_new] = cuts_.try_emplace(edge, static_cast<std::int32_t>(points_.size()));
    if (is_new) {
      const double inside = values_[edge.first], outside = values_[edge.second];
      const double t = inside / (inside - outside);
      points_.push_back((1 - t) * position(edge.first) + t * position(edge.second));
    }
    return entry->second;
  }

  SampleGrid grid_;
  std::int64_t step_y_, step_z_;
  std::vector<double> values_;
  HashMap<Edge, std::int32_t> cuts_;
  std::vector<Eigen::RowVector3d> points_;
  std::vector<Triangle> triangles_;
};

}  // namespace

TriangleMesh tetrahedra_surface(const ImplicitField& field, const SampleGrid& grid) {
  return Marcher(field, grid).surface();
}

}  // namespace lpdeform
