#pragma once

#include <cstdint>
#include <vector>

#include "core/base/geometry.h"
#include "core/mesh/weld.h"

namespace lpdeform {

/// Normals of a mesh's vertices while it is deformed.
///
/// Copies of a vertex that share a normal at rest, to within 1 degree, are a group: one smooth piece of
/// surface there. The faces around a group that use one of its copies give it the normal
///
///   N = sum over these faces of (angle at the vertex) x (unit normal), scaled to length 1
///
/// (Thuermer & Wuethrich 1998), which does not depend on how the surface is cut into triangles.
///
/// Without rest normals all copies of a vertex are one group and take N: smooth everywhere, seams do not
/// show. With them, each vertex keeps its own as it was drawn: the rest normal is held in the frame of N, the
/// direction of one edge of the group across N, and the two's cross product, and comes back in the frame that
/// the deformed surface has there. So at rest the normals are those given (scaled to length 1), a rigid
/// motion turns them as it turns the surface, a hard edge, whose copies have normals of their own, stays
/// hard, each side following its own faces, and a texture seam, whose copies share one, stays invisible.
///
/// Immutable; any thread.
class CarriedNormals {
 public:
  /// `faces` with indices in range and `rest` of the split mesh, finite. `rest_normals` has a row a split
  /// vertex, finite, of any length; 0 asks for N. Or it has no rows: N everywhere.
  CarriedNormals(Faces faces, const Points& rest, const Weld& weld, const Points& rest_normals);

  /// One normal a split vertex, of length 1. Where no face at the vertex has area, the rest normal as given,
  /// or 0 where there was none. Copies with the same rest normal get the same bits. O(n + m).
  Points at(const Points& positions) const;

  std::size_t memory_bytes() const;

 private:
  void find_groups(const Weld& weld, const Points& rest_normals);
  void find_references(const Points& rest, const Points& normals);
  Points group_normals(const Points& positions) const;
  Eigen::Matrix3d frame(std::int32_t group, const Eigen::RowVector3d& normal, const Points& positions) const;

  Faces faces_;
  std::vector<std::int32_t> group_of_;  // of each split vertex
  std::int32_t group_count_ = 0;
  // Only with rest normals.
  std::vector<std::int32_t> from_, to_;  // the ends of each group's edge; -1 where it has none
  Points local_;                         // the rest normals in their groups' frames
  Points kept_;                          // the same as given
};

}  // namespace lpdeform
