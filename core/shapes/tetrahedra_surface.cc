#include "core/shapes/tetrahedra_surface.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
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
      : field_(field),
        grid_(grid),
        step_y_(grid.cells[0] + 1),
        step_z_(step_y_ * (grid.cells[1] + 1)),
        is_inside_(step_z_ * (grid.cells[2] + 1)) {
    for (int z = 0; z <= grid.cells[2]; z += kBlock) {
      for (int y = 0; y <= grid.cells[1]; y += kBlock) {
        for (int x = 0; x <= grid.cells[0]; x += kBlock) sample_block({x, y, z});
      }
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

  double value(std::int64_t sample) const { return field_(position(sample)); }
  bool is_inside(std::int64_t sample) const { return is_inside_[sample] != 0; }

  /// The samples of a block, given by its lowest one, of kBlock along each side or fewer at the border. If the value in its middle is
  /// so far from 0 that no edge from within the block can be cut, that value decides for all.
  void sample_block(const std::array<int, 3>& low) {
    constexpr double kHalfSide = (kBlock - 1) / 2.0;
    const Eigen::RowVector3d middle =
        grid_.origin +
        grid_.spacing * Eigen::RowVector3d(low[0] + kHalfSide, low[1] + kHalfSide, low[2] + kHalfSide);
    const double far = kSteepestField * std::numbers::sqrt3 * (kHalfSide + 1) * grid_.spacing;
    const double in_middle = field_(middle);
    const bool decides = std::abs(in_middle) > far;
    std::array<int, 3> end;
    for (int axis = 0; axis < 3; ++axis) end[axis] = std::min(low[axis] + kBlock, grid_.cells[axis] + 1);
    for (int z = low[2]; z < end[2]; ++z) {
      for (int y = low[1]; y < end[1]; ++y) {
        for (int x = low[0]; x < end[0]; ++x) {
          const std::int64_t sample = x + step_y_ * y + step_z_ * z;
          is_inside_[sample] = (decides ? in_middle : value(sample)) < 0 ? 1 : 0;
        }
      }
    }
  }

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
      const double inside = value(edge.first), outside = value(edge.second);
      const double t = inside / (inside - outside);
      points_.push_back((1 - t) * position(edge.first) + t * position(edge.second));
    }
    return entry->second;
  }

  static constexpr int kBlock = 8;  // samples

  const ImplicitField& field_;
  SampleGrid grid_;
  std::int64_t step_y_, step_z_;
  std::vector<char> is_inside_;  // of each sample
  HashMap<Edge, std::int32_t> cuts_;
  std::vector<Eigen::RowVector3d> points_;
  std::vector<Triangle> triangles_;
};

}  // namespace

TriangleMesh tetrahedra_surface(const ImplicitField& field, const SampleGrid& grid) {
  return Marcher(field, grid).surface();
}

}  // namespace lpdeform
