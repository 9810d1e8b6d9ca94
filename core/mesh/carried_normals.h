#pragma once

#include <cstdint>
#include <vector>

#include "core/base/geometry.h"
#include "core/mesh/weld.h"

namespace lpdeform {

/// Vertex normals of a mesh while it is deformed.
///
/// A group is the set of copies of a vertex whose rest normals agree to within 1 degree: one smooth piece of the
/// surface. The faces that use one of the group's copies determine its normal,
///
///   N = sum over these faces of (angle at the vertex) x (unit normal), scaled to length 1
///
/// (Thuermer & Wuethrich 1998). It does not depend on how the surface is triangulated.
///
/// Without rest normals, all copies of a vertex form one group and have normal N: the surface is smooth everywhere, and
/// seams are invisible. With rest normals, each vertex keeps its own. The rest normal is stored in a local frame: N,
/// the direction of one edge of the group projected across N, and their cross product. It is then restored in the same
/// frame of the deformed surface. So at rest the normals are the given ones (scaled to length 1), and a rigid motion
/// rotates them with the surface. A hard edge, whose copies have different normals, stays hard: each side follows its
/// own faces. A texture seam, whose copies share a normal, stays invisible.
///
/// Immutable; thread-safe.
class CarriedNormals {
 public:
  /// `faces` (indices in range) and `rest` (finite) are those of the split mesh. `rest_normals` has one row per split
  /// vertex, finite, of any length, where 0 asks for N; or it has no rows, which gives N everywhere.
  CarriedNormals(Faces faces, const Points& rest, const Weld& weld, const Points& rest_normals);

  /// One normal of length 1 per split vertex. If no face at the vertex has area, the rest normal as given, or 0 if
  /// there was none. Copies with the same rest normal get the same bits. O(n + m).
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
  std::vector<std::int32_t> from_, to_;  // the ends of each group's edge; -1 if it has none
  Points local_;                         // the rest normals in their groups' frames
  Points kept_;                          // the rest normals as given
};

}  // namespace lpdeform
