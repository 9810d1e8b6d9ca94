#include "core/resize/resize_extents.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

namespace lpdeform {
namespace {

constexpr double kEnd = 0.01;  // relative to the extent
constexpr int kMostAtOneEnd = 32;
constexpr int kMostLocks = 480;

/// The lowest and the highest coordinate of each component along each axis.
struct Extents {
  std::vector<Eigen::Array3d> low, high;
};

Extents extents_of(const RestShape& shape, const Points& along) {
  const double infinity = std::numeric_limits<double>::infinity();
  const auto count = static_cast<std::size_t>(shape.component_count());
  Extents extents{std::vector<Eigen::Array3d>(count, Eigen::Array3d::Constant(infinity)),
                  std::vector<Eigen::Array3d>(count, Eigen::Array3d::Constant(-infinity))};
  for (Eigen::Index i = 0; i < along.rows(); ++i) {
    const std::int32_t component = shape.components()[i];
    if (component < 0) continue;
    extents.low[component] = extents.low[component].min(along.row(i).transpose().array());
    extents.high[component] = extents.high[component].max(along.row(i).transpose().array());
  }
  return extents;
}

Points coordinates(const RestShape& shape, const Eigen::Matrix3d& axes, const Points& positions) {
  return (positions.rowwise() - shape.centre()) * axes.transpose();
}

/// Farthest-point sampling: up to `count` of the vertices, beginning with the first; each next one is the farthest from
/// those chosen before it.
std::vector<std::int32_t> farthest_apart(const Points& positions, const std::vector<std::int32_t>& vertices,
                                         int count) {
  std::vector<double> distance(vertices.size(), std::numeric_limits<double>::infinity());
  std::vector<std::int32_t> chosen;
  std::size_t next = 0;
  while (static_cast<int>(chosen.size()) < count && next < vertices.size() && distance[next] > 0) {
    chosen.push_back(vertices[next]);
    for (std::size_t k = 0; k < vertices.size(); ++k) {
      const double from_chosen = (positions.row(vertices[k]) - positions.row(chosen.back())).squaredNorm();
      distance[k] = std::min(distance[k], from_chosen);
    }
    next = static_cast<std::size_t>(std::max_element(distance.begin(), distance.end()) - distance.begin());
  }
  return chosen;
}

/// End vertices along `axis`, spread out, from those that are not taken.
std::vector<std::int32_t> spread_ends(const RestShape& shape, const Eigen::Matrix3d& axes, int axis,
                                      const std::vector<char>& is_taken) {
  const int at_one_end = std::min(kMostAtOneEnd, kMostLocks / (2 * shape.component_count()));
  const Points along = coordinates(shape, axes, shape.positions());
  const Extents extents = extents_of(shape, along);
  // The low and the high end of each component. All vertices of a flat component are in its low end.
  std::vector<std::array<std::vector<std::int32_t>, 2>> ends(
      static_cast<std::size_t>(shape.component_count()));
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    const std::int32_t component = shape.components()[i];
    if (component < 0 || is_taken[i] != 0) continue;
    const double low = extents.low[component][axis], high = extents.high[component][axis];
    const double x = along(i, axis), margin = kEnd * (high - low);
    if (x <= low + margin) {
      ends[component][0].push_back(i);
    } else if (x >= high - margin) {
      ends[component][1].push_back(i);
    }
  }
  std::vector<std::int32_t> result;
  for (const auto& both : ends) {
    for (const auto& end : both) {
      const auto chosen = farthest_apart(shape.positions(), end, at_one_end);
      result.insert(result.end(), chosen.begin(), chosen.end());
    }
  }
  return result;
}

}  // namespace

std::vector<std::int32_t> ends_along(const RestShape& shape, const Eigen::Matrix3d& axes,
                                     const Eigen::Array<bool, 3, 1>& is_wanted) {
  const Points along = coordinates(shape, axes, shape.positions());
  const Extents extents = extents_of(shape, along);
  std::vector<std::int32_t> ends;
  for (Eigen::Index i = 0; i < along.rows(); ++i) {
    const std::int32_t component = shape.components()[i];
    if (component < 0) continue;
    const Eigen::Array3d low = extents.low[component], high = extents.high[component];
    const Eigen::Array3d x = along.row(i).transpose().array(), margin = kEnd * (high - low);
    const auto is_end = (x <= low + margin || x >= high - margin) && is_wanted;
    if (is_end.any()) ends.push_back(static_cast<std::int32_t>(i));
  }
  return ends;
}

std::vector<Handle> side_locks(const RestShape& shape, const Eigen::Matrix3d& axes, int stretched) {
  std::vector<char> is_taken(static_cast<std::size_t>(shape.vertex_count()), 0);
  const auto take = [&](const std::vector<std::int32_t>& vertices) {
    for (const std::int32_t vertex : vertices) is_taken[vertex] = 1;
  };
  take(ends_along(shape, axes, Eigen::Array3i(0, 1, 2) == stretched));
  std::vector<Handle> locks;
  for (int axis = 0; axis < 3; ++axis) {
    if (axis == stretched) continue;
    Handle lock{.vertices = spread_ends(shape, axes, axis, is_taken),
                .hold = PlaneLock{axes.row(axis).transpose()}};
    take(lock.vertices);
    if (!lock.vertices.empty()) locks.push_back(std::move(lock));
  }
  return locks;
}

Points with_extents(const RestShape& shape, const Eigen::Matrix3d& axes, const Points& positions,
                    const Points& wanted) {
  Points along = coordinates(shape, axes, positions);
  const Extents from = extents_of(shape, along), to = extents_of(shape, coordinates(shape, axes, wanted));
  Points result = wanted;
  for (Eigen::Index i = 0; i < along.rows(); ++i) {
    const std::int32_t component = shape.components()[i];
    if (component < 0) continue;
    const Eigen::Array3d low = from.low[component], extent = from.high[component] - low;
    const Eigen::Array3d factor =
        (extent > 0).select((to.high[component] - to.low[component]) / extent, Eigen::Array3d::Ones());
    const Eigen::Array3d moved = (along.row(i).transpose().array() - low) * factor + to.low[component];
    result.row(i) = moved.matrix().transpose() * axes + shape.centre();
  }
  return result;
}

}  // namespace lpdeform
