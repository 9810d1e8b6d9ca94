#pragma once

#include <cstdint>
#include <functional>
#include <numeric>
#include <span>
#include <vector>

#include "core/base/geometry.h"

namespace lpdeform {

/// Disjoint sets of the integers 0 to n - 1 (union-find).
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }

  /// The lowest member of the set of `item`.
  std::int32_t find(std::int32_t item) {
    while (parent_[item] != item) item = parent_[item] = parent_[parent_[item]];
    return item;
  }

  /// False if both were already in the same set.
  bool unite(std::int32_t a, std::int32_t b) {
    a = find(a), b = find(b);
    if (a == b) return false;
    if (a > b) std::swap(a, b);
    parent_[b] = a;
    return true;
  }

 private:
  std::vector<std::int32_t> parent_;
};

/// One side of a face. Side k of face f runs from corner k to corner k + 1 (mod 3) and has the id 3 f + k,
/// which is also the id of the corner it starts from.
struct HalfEdge {
  std::int32_t high;  // the higher of its two vertices
  std::int32_t id;
};

/// The id of the corner at which the half-edge `id` ends.
inline std::int32_t next_corner(std::int32_t id) {
  return id % 3 == 2 ? id - 2 : id + 1;
}

/// The undirected edges of a triangle list, which may be non-manifold: half-edges grouped by their two vertices.
class EdgeTable {
 public:
  /// Includes the faces for which `takes(f)` is true; their indices must be in [0, vertices). Sides from a vertex to
  /// itself are left out. O(n + m log k), where k is the largest number of half-edges at one vertex.
  EdgeTable(std::int64_t vertices, const Faces& faces, const std::function<bool(Eigen::Index)>& takes);

  /// Calls `visit(low, high, half_edges)` for each edge, in ascending order of (low, high).
  void for_edges(
      const std::function<void(std::int32_t low, std::int32_t high, std::span<const HalfEdge>)>& visit) const;

 private:
  std::vector<std::int32_t> start_;  // the first half-edge of each lower vertex in half_edges_
  std::vector<HalfEdge> half_edges_;
};

}  // namespace lpdeform
