#include "core/mesh/corner_table.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "core/mesh/half_edges.h"

namespace lpdeform {

CornerTable::CornerTable(const TriangleMesh& mesh)
    : points_(mesh.vertices), vertex_(mesh.faces.data(), mesh.faces.data() + mesh.faces.size()) {
  for (std::size_t f = 0; f < vertex_.size(); f += 3) {
    std::int32_t* const corners = vertex_.data() + f;
    if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0]) corners[0] = -1;
  }
  if (!join(mesh.faces)) join(mesh.faces);  // now of the faces that are kept
  number_edges();
  lock_joints();
}

/// Finds the twins. False if half-edges are in several faces: it has then left faces out.
bool CornerTable::join(const Faces& faces) {
  twin_.assign(vertex_.size(), -1);
  std::vector<Claim> claims;
  std::int32_t shared = 0;  // half-edges that are in several faces
  const EdgeTable edges(points_.rows(), faces, [&](Eigen::Index f) { return vertex_[3 * f] >= 0; });
  edges.for_edges([&](std::int32_t low, std::int32_t, std::span<const HalfEdge> half_edges) {
    std::array<std::int32_t, 2> first{-1, -1};  // from low to high, and back
    bool is_shared = false;
    for (const HalfEdge half_edge : half_edges) {
      std::int32_t& same = first[faces.data()[half_edge.id] == low ? 0 : 1];
      if (same >= 0)
        is_shared = true;
      else
        same = half_edge.id;
    }
    if (is_shared) {
      for (const HalfEdge half_edge : half_edges)
        claims.push_back({half_edge.id, shared + (faces.data()[half_edge.id] == low ? 0 : 1)});
      shared += 2;
    } else if (first[0] >= 0 && first[1] >= 0) {
      twin_[first[0]] = first[1];
      twin_[first[1]] = first[0];
    }
  });
  leave_out(std::move(claims), shared);
  return shared == 0;
}

/// Leaves a face out if an earlier one that is kept has one of its half-edges.
void CornerTable::leave_out(std::vector<Claim> claims, std::int32_t shared) {
  std::sort(claims.begin(), claims.end(), [](Claim a, Claim b) { return a.half_edge < b.half_edge; });
  std::vector<char> is_taken(shared, 0);
  for (auto begin = claims.begin(), end = begin; begin != claims.end(); begin = end) {
    const std::int32_t face = begin->half_edge / 3;
    end = std::find_if(begin, claims.end(), [&](Claim claim) { return claim.half_edge / 3 != face; });
    if (std::any_of(begin, end, [&](Claim claim) { return is_taken[claim.shared] != 0; }))
      vertex_[3 * face] = -1;
    else
      std::for_each(begin, end, [&](Claim claim) { is_taken[claim.shared] = 1; });
  }
}

void CornerTable::number_edges() {
  edge_.assign(vertex_.size(), -1);
  corner_.assign(points_.rows(), -1);
  for (std::int32_t c = 0; c < static_cast<std::int32_t>(vertex_.size()); ++c) {
    if (vertex_[c - c % 3] < 0) continue;
    corner_[vertex_[c]] = c;
    if (edge_[c] >= 0) continue;
    edge_[c] = edge_count();
    if (twin_[c] >= 0) edge_[twin_[c]] = edge_[c];
    edges_.push_back({c, true});
    squared_lengths_.push_back(squared_length_of(c));
  }
}

/// Locks each vertex whose faces form more than one fan.
void CornerTable::lock_joints() {
  std::vector<std::int32_t> not_reached(points_.rows(), 0);
  for (std::size_t c = 0; c < vertex_.size(); ++c) {
    if (vertex_[c - c % 3] >= 0) ++not_reached[vertex_[c]];
  }
  is_locked_.assign(not_reached.size(), 0);
  for (std::size_t v = 0; v < not_reached.size(); ++v) {
    if (corner_[v] < 0) continue;
    visit_corners(static_cast<std::int32_t>(v), [&](std::int32_t) { return --not_reached[v], true; });
    is_locked_[v] = not_reached[v] > 0 ? 1 : 0;
  }
}

double CornerTable::squared_length_of(std::int32_t half_edge) const {
  return (points_.row(vertex_[next(half_edge)]) - points_.row(vertex_[half_edge])).squaredNorm();
}

std::array<CornerTable::Way, 2> CornerTable::ways(std::int32_t edge) const {
  const auto [half_edge, is_along] = edges_[edge];
  const std::int32_t a = vertex_[half_edge], b = vertex_[next(half_edge)], twin = twin_[half_edge];
  const Way there{a, b, half_edge, twin}, back{b, a, twin, half_edge};
  if (is_along) return {there, back};
  return {back, there};
}

/// Calls visit for the corners at the vertex in turn until it returns false. Returns whether the vertex is on a boundary, if all
/// were visited.
template <typename Visit>
bool CornerTable::visit_corners(std::int32_t vertex, const Visit& visit) const {
  const std::int32_t first = corner_[vertex];
  std::int32_t c = first;
  do {
    if (!visit(c)) return false;
    c = twin_[previous(c)];
  } while (c >= 0 && c != first);
  if (c == first) return false;
  for (c = twin_[first]; c >= 0; c = twin_[c]) {
    c = next(c);
    if (!visit(c)) return true;
  }
  return true;
}

/// False if the vertex has more than kMostNeighbours corners.
bool CornerTable::find_fan(std::int32_t vertex, Fan& fan) const {
  fan.size = 0;
  bool fits = true;
  fan.is_open = visit_corners(vertex, [&](std::int32_t corner) {
    if (fan.size == kMostNeighbours) return fits = false;
    fan.corners[fan.size++] = corner;
    return true;
  });
  return fits;
}

/// Whether the two other edges of its face are on a boundary.
bool CornerTable::has_two_free_sides(std::int32_t half_edge) const {
  return half_edge >= 0 && twin_[next(half_edge)] < 0 && twin_[previous(half_edge)] < 0;
}

/// The link condition: every common neighbour of the two vertices is opposite of the edge.
bool CornerTable::is_linked_by_edge_only(const Way& way) const {
  const std::int32_t left = apex(way.left), right = apex(way.right);
  if (left == right) return false;
  std::array<std::int32_t, 2 * kMostNeighbours> ring;
  std::size_t size = 0;
  for (const std::int32_t c : to_.all()) {
    ring[size++] = vertex_[next(c)];
    if (to_.is_open) ring[size++] = vertex_[previous(c)];
  }
  const auto is_common = [&](std::int32_t v) {
    return v != left && v != right && std::find(ring.begin(), ring.begin() + size, v) != ring.begin() + size;
  };
  return std::none_of(from_.all().begin(), from_.all().end(), [&](std::int32_t c) {
    return is_common(vertex_[next(c)]) || (from_.is_open && is_common(vertex_[previous(c)]));
  });
}

bool CornerTable::keeps_orientation(const Way& way, double cosine) const {
  const Eigen::RowVector3d from = points_.row(way.from), to = points_.row(way.to);
  for (const std::int32_t corner : from_.all()) {
    const std::int32_t second = vertex_[next(corner)], third = vertex_[previous(corner)];
    if (second == way.to || third == way.to) continue;
    const Eigen::RowVector3d b = points_.row(second), c = points_.row(third);
    const Eigen::RowVector3d before = (b - from).cross(c - from), after = (b - to).cross(c - to);
    // A sliver may turn, since it has no direction to keep, but no face may become one.
    if (!(after.squaredNorm() > 0) || before.dot(after) < cosine * before.norm() * after.norm()) return false;
  }
  return true;
}

bool CornerTable::may_collapse(const Way& way, int most_neighbours, double cosine) {
  if (is_locked_[way.from] != 0 || is_locked_[way.to] != 0 || !find_fan(way.from, from_)) return false;
  const bool is_on_boundary = way.left < 0 || way.right < 0;
  if (from_.is_open && !is_on_boundary) return false;
  if (!find_fan(way.to, to_) || from_.neighbours() + to_.neighbours() > most_neighbours) return false;
  return !has_two_free_sides(way.left) && !has_two_free_sides(way.right) && is_linked_by_edge_only(way) &&
         keeps_orientation(way, cosine);
}

/// Removes a face. `kept` and `dropped` are two of its half-edges. Their edges become one, the edge of `kept`.
void CornerTable::drop_face(std::int32_t kept, std::int32_t dropped) {
  const std::int32_t beside_kept = twin_[kept], beside_dropped = twin_[dropped];
  if (beside_kept >= 0) twin_[beside_kept] = beside_dropped;
  if (beside_dropped >= 0) {
    twin_[beside_dropped] = beside_kept;
    edge_[beside_dropped] = edge_[kept];
  }
  Edge& edge = edges_[edge_[kept]];
  if (edge.half_edge == kept && beside_dropped >= 0)
    edge.half_edge = beside_dropped;
  else if (edge.half_edge == kept)
    edge = {beside_kept, !edge.is_along};
  edges_[edge_[dropped]].half_edge = -1;
  for (const std::int32_t c : {beside_kept, beside_dropped}) {
    if (c >= 0) corner_[vertex_[c]] = c, corner_[vertex_[next(c)]] = next(c);
  }
  vertex_[kept - kept % 3] = -1;
}

void CornerTable::collapse(const Way& way) {
  edges_[edge_[way.left >= 0 ? way.left : way.right]].half_edge = -1;
  for (const std::int32_t c : from_.all()) vertex_[c] = way.to;
  if (way.left >= 0) drop_face(next(way.left), previous(way.left));
  if (way.right >= 0) drop_face(previous(way.right), next(way.right));
  corner_[way.from] = -1;
  for (const std::int32_t c : from_.all()) {
    if (vertex_[c - c % 3] < 0) continue;
    squared_lengths_[edge_[c]] = squared_length_of(c);
    squared_lengths_[edge_[previous(c)]] = squared_length_of(previous(c));
  }
}

Faces CornerTable::faces() const {
  std::vector<std::int32_t> corners;
  for (std::size_t f = 0; f < vertex_.size(); f += 3) {
    if (vertex_[f] >= 0) corners.insert(corners.end(), vertex_.begin() + f, vertex_.begin() + f + 3);
  }
  return Eigen::Map<const Faces>(corners.data(), static_cast<Eigen::Index>(corners.size() / 3), 3);
}

}  // namespace lpdeform
