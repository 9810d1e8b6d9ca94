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
      : field_(field), grid_(grid), step_y_(grid.cells[0] + 1), step_z_(step_y_ * (grid.cells[1] + 1)) {
    for (int axis = 0; axis < 3; ++axis) blocks_[axis] = grid.cells[axis] / kBlock + 1;
    first_flag_.reserve(static_cast<std::size_t>(blocks_[0]) * blocks_[1] * blocks_[2]);
    for (int z = 0; z < blocks_[2]; ++z) {
      for (int y = 0; y < blocks_[1]; ++y) {
        for (int x = 0; x < blocks_[0]; ++x) add_block({kBlock * x, kBlock * y, kBlock * z});
      }
    }
  }

  TriangleMesh surface() {
    for (std::int64_t z = 0; z < grid_.cells[2]; ++z) {
      for (std::int64_t y = 0; y < grid_.cells[1]; ++y) {
        for (int block = 0; block < blocks_[0]; ++block) {
          if (may_be_cut({block, static_cast<int>(y / kBlock), static_cast<int>(z / kBlock)}))
            cut_cubes(block, y, z);
        }
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
  struct Sample {
    std::int64_t number;
    bool is_inside;
  };

  Eigen::RowVector3d position(std::int64_t sample) const {
    const std::int64_t x = sample % step_y_, y = sample % step_z_ / step_y_, z = sample / step_z_;
    return grid_.origin + grid_.spacing * Eigen::RowVector3d(x, y, z);
  }

  double value(std::int64_t sample) const { return field_(position(sample)); }

  std::int64_t block_at(int x, int y, int z) const {
    return x + static_cast<std::int64_t>(blocks_[0]) * (y + static_cast<std::int64_t>(blocks_[1]) * z);
  }

  bool is_inside(int x, int y, int z) const {
    const std::int64_t first = first_flag_[block_at(x / kBlock, y / kBlock, z / kBlock)];
    if (first < 0) return first == kInside;
    return flags_[first + x % kBlock + kBlock * (y % kBlock + kBlock * (z % kBlock))] != 0;
  }

  /// Adds the block whose lowest sample is `low`. If the value in its middle is so far from 0 that all of its samples must have the
  /// same sign, the block keeps that sign alone.
  void add_block(const std::array<int, 3>& low) {
    constexpr double kHalfSide = (kBlock - 1) / 2.0;
    const Eigen::RowVector3d at(low[0], low[1], low[2]);
    const double in_middle = field_(grid_.origin + grid_.spacing * (at.array() + kHalfSide).matrix());
    const double farthest = std::numbers::sqrt3 * kHalfSide * grid_.spacing;  // sample from the middle
    if (std::abs(in_middle) > kSteepestField * farthest) {
      first_flag_.push_back(in_middle < 0 ? kInside : kOutside);
      return;
    }
    first_flag_.push_back(static_cast<std::int64_t>(flags_.size()));
    for (int z = 0; z < kBlock; ++z) {
      for (int y = 0; y < kBlock; ++y) {
        for (int x = 0; x < kBlock; ++x) {
          const bool is_in_grid =
              low[0] + x < step_y_ && low[1] + y <= grid_.cells[1] && low[2] + z <= grid_.cells[2];
          const std::int64_t sample = low[0] + x + step_y_ * (low[1] + y) + step_z_ * (low[2] + z);
          flags_.push_back(is_in_grid && value(sample) < 0 ? 1 : 0);
        }
      }
    }
  }

  /// Whether a cube whose lowest sample is in this block may be cut: not if the block and those next to it are all inside or all
  /// outside.
  bool may_be_cut(const std::array<int, 3>& block) const {
    const std::int64_t first = first_flag_[block_at(block[0], block[1], block[2])];
    if (first >= 0) return true;
    std::array<int, 3> next;
    for (int axis = 0; axis < 3; ++axis) next[axis] = std::min(block[axis] + 1, blocks_[axis] - 1);
    for (int corner = 1; corner < 8; ++corner) {
      const std::int64_t other =
          first_flag_[block_at((corner & 1) != 0 ? next[0] : block[0], (corner & 2) != 0 ? next[1] : block[1],
                               (corner & 4) != 0 ? next[2] : block[2])];
      if (other != first) return true;
    }
    return false;
  }

  /// Cuts the cubes of a row whose lowest samples are in the same block.
  void cut_cubes(int block, std::int64_t y, std::int64_t z) {
    const int end = std::min(kBlock * (block + 1), grid_.cells[0]);
    for (int x = kBlock * block; x < end; ++x) cut_cube(x, static_cast<int>(y), static_cast<int>(z));
  }

  void cut_cube(int x, int y, int z) {
    const std::int64_t lowest = x + step_y_ * y + step_z_ * z;
    std::array<Sample, 8> samples;
    int inside = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const int right = corner & 1, back = corner >> 1 & 1, up = corner >> 2;
      samples[corner] = {lowest + right + back * step_y_ + up * step_z_,
                         is_inside(x + right, y + back, z + up)};
      inside += samples[corner].is_inside ? 1 : 0;
    }
    if (inside == 0 || inside == 8) return;
    for (const std::array<int, 4>& tetrahedron : kTetrahedra) {
      std::array<Sample, 4> corners;
      for (int k = 0; k < 4; ++k) corners[k] = samples[tetrahedron[k]];
      cut_tetrahedron(corners);
    }
  }

  void cut_tetrahedron(std::array<Sample, 4> corners) {
    const auto middle = std::stable_partition(corners.begin(), corners.end(),
                                              [](const Sample& sample) { return sample.is_inside; });
    const std::int64_t a = corners[0].number, b = corners[1].number, c = corners[2].number,
                       d = corners[3].number;
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

  static constexpr int kBlock = 8;  // samples along each side
  static constexpr std::int64_t kInside = -1, kOutside = -2;

  const ImplicitField& field_;
  SampleGrid grid_;
  std::int64_t step_y_, step_z_;
  std::array<int, 3> blocks_;             // along each axis
  std::vector<std::int64_t> first_flag_;  // of each block, in flags_; kInside or kOutside if it has none
  std::vector<char> flags_;               // whether each sample of such a block is inside
  HashMap<Edge, std::int32_t> cuts_;
  std::vector<Eigen::RowVector3d> points_;
  std::vector<Triangle> triangles_;
};

}  // namespace

TriangleMesh tetrahedra_surface(const ImplicitField& field, const SampleGrid& grid) {
  return Marcher(field, grid).surface();
}

}  // namespace lpdeform
