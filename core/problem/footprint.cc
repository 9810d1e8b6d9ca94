#include "core/problem/footprint.h"

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <queue>
#include <unordered_map>
#include <utility>

namespace lpdeform {
namespace {

/// The shortest distances from a handle up to its radius, by Dijkstra's algorithm.
std::unordered_map<std::int32_t, double> distances(const RestShape& shape, const Handle& handle) {
  using Place = std::pair<double, std::int32_t>;
  const Points& rest = shape.positions();
  std::unordered_map<std::int32_t, double> nearest;
  std::priority_queue<Place, std::vector<Place>, std::greater<>> open;
  const auto reach = [&](std::int32_t vertex, double distance) {
    if (!(distance < handle.footprint)) return;
    const auto [place, is_new] = nearest.try_emplace(vertex, distance);
    if (!is_new && place->second <= distance) return;
    place->second = distance;
    open.emplace(distance, vertex);
  };
  for (const std::int32_t vertex : handle.vertices) reach(vertex, 0);
  const Points points = rest_positions(handle, rest, shape.faces());
  for (std::size_t k = 0; k < handle.points.size(); ++k) {
    for (int c = 0; c < 3; ++c) {
      const std::int32_t corner = shape.faces()(handle.points[k].face, c);
      reach(corner, (rest.row(corner) - points.row(k)).norm());
    }
  }
  while (!open.empty()) {
    const auto [distance, i] = open.top();
    open.pop();
    if (distance > nearest.at(i)) continue;
    for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
      const std::int32_t j = shape.neighbours()[k];
      reach(j, distance + (rest.row(i) - rest.row(j)).norm());
    }
  }
  return nearest;
}

}  // namespace

Field footprint_stiffness(const RestShape& shape, const HandleSet& handles) {
  Field result;
  for (const auto& [name, handle] : handles.handles()) {
    if (handle.footprint == 0) continue;
    if (result.size() == 0) result = Field::Ones(shape.vertex_count());
    for (const auto& [vertex, distance] : distances(shape, handle)) {
      const double share = distance / handle.footprint, fall = 1 - share * share;
      result[vertex] = std::max(result[vertex], 1 + (kFootprintStiffness - 1) * fall * fall);
    }
  }
  return result;
}

}  // namespace lpdeform
