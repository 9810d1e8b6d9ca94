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
  /// Leaves out a face that names a vertex twice, and a face if an earlier one that is kept has the same half-edge from a to b.
  /// Indices must be in range. The vertices of `mesh` must outlive this object.
  explicit CornerTable(const TriangleMesh& mesh);
  explicit CornerTable(TriangleMesh&& mesh) = delete;

  /// Edges keep their numbers.
  std::int32_t edge_count() const { return static_cast<std::int32_t>(edges_.size()); }
  /// Whether the edge was collapsed, or became one with another.
  bool is_gone(std::int32_t edge) const { return edges_[edge].half_edge < 0; }
  /// Not of an edge that is gone.
  double squared_length(std::int32_t edge) const { return squared_lengths_[edge]; }

  /// An edge seen as the way from one of its ends to the other.
  struct Way {
    std::int32_t from, to;  // vertices
    std::int32_t left;      // the half-edge from -> to
    std::int32_t right;     // the half-edge to -> from
  };
  /// The first way runs as the edge does in the first of its faces. The second runs back. Not of an edge that is gone.
  std::array<Way, 2> ways(std::int32_t edge) const;

  static constexpr int kMostNeighbours = 32;
  /// Whether way.from may become one with way.to: the mesh stays a manifold, boundaries stay boundaries, the two vertices have at most
  /// `most_neighbours` <= kMostNeighbours neighbours together, and the faces that remain turn by no more than the angle with this
  /// cosine. False if the mesh is not a manifold at one of the two vertices.
  bool may_collapse(const Way& way, int most_neighbours, double cosine);
  /// Collapses the way. Call it right after may_collapse(way, ...) has returned true: it uses what that call has found.
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
    std::int32_t half_edge;  // -1: gone
    bool is_along;           // its first way is that of half_edge
  };

  static std::int32_t next(std::int32_t corner) { return corner % 3 == 2 ? corner - 2 : corner + 1; }
  static std::int32_t previous(std::int32_t corner) { return corner % 3 == 0 ? corner + 2 : corner - 1; }

  /// A half-edge of a face that is in other faces, too: number `shared` of these.
  struct Claim {
    std::int32_t half_edge, shared;
  };
  bool join(const Faces& faces);
  void leave_out(std::vector<Claim> claims, std::int32_t shared);
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
  Fan from_, to_;                        // what may_collapse() found last
};

}  // namespace lpdeform
