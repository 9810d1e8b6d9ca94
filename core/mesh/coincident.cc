#include "core/mesh/coincident.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/base/hash_map.h"
#include "core/mesh/half_edges.h"

namespace lpdeform {
namespace {

constexpr std::int64_t kMostDistances = 1000;  // per point

struct Box {
  Eigen::RowVector3d low = Eigen::RowVector3d::Zero(), high = Eigen::RowVector3d::Zero();
};

Box box_of_finite(const Points& points) {
  Box box;
  bool is_first = true;
  for (const auto& point : points.rowwise()) {
    if (!point.allFinite()) continue;
    box.low = is_first ? Eigen::RowVector3d(point) : box.low.cwiseMin(point);
    box.high = is_first ? Eigen::RowVector3d(point) : box.high.cwiseMax(point);
    is_first = false;
  }
  return box;
}

/// The points added so far, in the cubes of a grid. Lengths are relative to the box's largest extent, so that neither
/// very large nor very small coordinates leave the range of a double.
class Grid {
 public:
  Grid(const Points& points, std::size_t count, double share) : points_(points), next_(points.rows(), -1) {
    const Box box = box_of_finite(points);
    low_ = box.low / 2;
    half_extent_ = (box.high / 2 - low_).maxCoeff();
    if (half_extent_ == 0) half_extent_ = 1;
    const double diagonal = ((box.high / 2 - low_) / half_extent_).norm();
    nearest_ = share * diagonal;
    // Cells are small enough to hold few points of a surface, and large enough that a ball meets at most eight of them.
    const double spacing = diagonal / (2 * std::sqrt(static_cast<double>(count) + 1));
    side_ = std::max({std::clamp(spacing, 2 * nearest_, 64 * nearest_), 1e-12});
    heads_.reserve(count);
  }

  /// Calls `meets(other)` for earlier points that `point` coincides with; adds `point` if it is at a new place. Returns
  /// the number of distances computed.
  template <typename Meets>
  std::int64_t add(std::int32_t point, const Meets& meets) {
    const Eigen::RowVector3d at = (points_.row(point) / 2 - low_) / half_extent_;
    std::int64_t distances = 0;
    bool has_twin = false;
    const Cell from = cell_of(at.array() - nearest_), to = cell_of(at.array() + nearest_);
    for (Cell cell = from; cell[0] <= to[0]; ++cell[0]) {
      for (cell[1] = from[1]; cell[1] <= to[1]; ++cell[1]) {
        for (cell[2] = from[2]; cell[2] <= to[2]; ++cell[2]) {
          const auto head = heads_.find(cell);
          if (head == heads_.end()) continue;
          for (std::int32_t other = head->second; other >= 0; other = next_[other], ++distances) {
            const double distance = ((points_.row(point) / 2 - points_.row(other) / 2) / half_extent_).norm();
            if (distance > nearest_) continue;
            meets(other);
            has_twin = has_twin || points_.row(point) == points_.row(other);
          }
        }
      }
    }
    if (has_twin) return distances;
    const auto [head, is_new] = heads_.try_emplace(cell_of(at), point);
    if (!is_new) next_[point] = std::exchange(head->second, point);
    return distances;
  }

 private:
  using Cell = std::array<std::int64_t, 3>;

  Cell cell_of(const Eigen::RowVector3d& at) const {
    Cell cell;
    for (int axis = 0; axis < 3; ++axis) cell[axis] = static_cast<std::int64_t>(std::floor(at[axis] / side_));
    return cell;
  }

  const Points& points_;
  Eigen::RowVector3d low_;  // halved, like all extents here: full ones may overflow
  double half_extent_ = 1, nearest_ = 0, side_ = 1;
  HashMap<Cell, std::int32_t> heads_;  // the last point of each cell
  std::vector<std::int32_t> next_;     // the previous point in the cell of each point
};

}  // namespace

double diagonal_of(const Points& points) {
  const Box box = box_of_finite(points);
  return (box.high - box.low).stableNorm();
}

Coincident coincident(const Points& points, const std::vector<std::int32_t>& among, double share) {
  Coincident found;
  DisjointSets sets(points.rows());
  Grid grid(points, among.size(), share);
  std::int64_t left = kMostDistances * static_cast<std::int64_t>(among.size());
  for (const std::int32_t point : among) {
    if (!points.row(point).allFinite()) continue;
    left -= grid.add(point, [&](std::int32_t other) { sets.unite(point, other); });
    found.is_complete = left >= 0;
    if (!found.is_complete) break;
  }
  found.lowest.resize(points.rows());
  for (std::size_t p = 0; p < found.lowest.size(); ++p)
    found.lowest[p] = sets.find(static_cast<std::int32_t>(p));
  return found;
}

}  // namespace lpdeform
