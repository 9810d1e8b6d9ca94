#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/mesh/mesh.h"

namespace lpdeform {

/// A triangle mesh whose edges can be collapsed, as a corner table (Rossignac 2001). Corner 3 f + k is corner k of face f. It also stands
/// for the half-edge from there to the next corner of the face. -1 stands for none. One caller at a time.
class CornerTable {
 public:
  /// Leaves faces out that have a vertex twice, and those that have a half-edge from a to b in common with an earlier face. The mesh's
  /// vertices must outlive this object.
  explicit CornerTable(const TriangleMesh& mesh);

  /// Edges keep their numbers. Those of collapsed faces are gone.
  std::int32_t edge_count() const { return static_cast<std::int32_t>(edges_.size()); }
  /// Infinite if the edge is gone.
  double squared_length(std::int32_t edge) const { return squared_lengths_[edge]; }

  /// An edge seen as the way from one of its ends to the other.
  struct Way {
    std::int32_t from, to;  // vertices
    std::int32_t left;      // the half-edge from -> to
    std::int32_t right;     // the half-edge to -> from
  };
  /// First the way that the edge has in the first of its faces, then the way back.
  std::array<Way, 2> ways(std::int32_t edge) const;

  /// Whether way.from may become one with way.to: the mesh stays a manifold, boundaries stay boundaries, the two vertices have at most
  /// `most_neighbours` <= kMostNeighbours neighbours together, and the faces that remain turn by no more than the angle with this
  /// cosine. False if the mesh is not a manifold at one of the two vertices.
  static constexpr int kMostNeighbours = 32;
  bool may_collapse(const Way& way, int most_neighbours, double cosine);
  /// Does that. Only right after may_collapse(way, ...) has returned true.
  void collapse(const Way& way);

  /// The faces that are left, in their order.
  Faces faces() const;

 private:
  /// The corners at a vertex, of its faces in turn.
  struct Fan {
    std::array<std::int32_t, kMostNeighbours> corners;
    int size = 0;
    bool is_open = false;  // the vertex is on a boundary

    std::span<const std::int32_t> all() const { return {corners.data(), static_cast<std::size_t>(size)}; }
    int neighbours() const { return is_open ? size + 1 : size; }
  };
  struct Edge {
    std::int32_t half_edge;
    bool is_along;  // its first way is that of half_edge
  };

  static std::int32_t next(std::int32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
  static std::int32_t previous(std::int32_t corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }

  bool join_once(const Faces& faces);
  void number_edges();
  void lock_joints();
  double squared_length_of(std::int32_t half_edge) const;
  template <typename Visit>
  bool visit_corners(std::int32_t vertex, const Visit& visit) const;
  bool find_fan(std::int32_t vertex, Fan& fan) const;
  std::int32_t apex(std::int32_t half_edge) const {
    return half_edge < 0 ? -1 : vertex_[previous(half_edge)];
  }
  bool has_two_free_sides(std::int32_t half_edge) const;
  bool is_linked_by_edge_only(const Way& way) const;
  bool keeps_orientation(const Way& way, double cosine) const;
  void drop_face(std::int32_t kept, std::int32_t dropped);

  const Points& points_;
  std::vector<std::int32_t> vertex_;  // of each corner; -1 where the face is gone
  std::vector<std::int32_t> twin_;    // of each half-edge: the one of the other face at the edge
  std::vector<std::int32_t> edge_;    // of each half-edge
  std::vector<std::int32_t> corner_;  // of each vertex: one of its corners
  std::vector<char> is_locked_;       // of each vertex: the mesh is not a manifold there
  std::vector<Edge> edges_;
  std::vector<double> squared_lengths_;  // of the edges
  Fan from_, to_;                        // of the way that was looked at last
};

}  // namespace lpdeform
