#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/mesh.h"
#include "core/mesh/report.h"

namespace lpdeform {

/// Which vertices of a mesh are copies of the same vertex. A mesh made for drawing has several vertices in one place
/// along seams of texture coordinates or normals. In a deformation they must be one vertex, or the surface would split
/// open there. The given mesh is called split; the mesh with one vertex per place is called welded. Welded vertices are
/// numbered in the order of their lowest copies.
struct Weld {
  std::vector<std::int32_t> to_welded;   // one per split vertex
  std::vector<std::int32_t> first_copy;  // one per welded vertex: its lowest copy, ascending
  double same_place = 0;  // positions given for copies may differ by this much: kSamePlace of the diagonal

  std::int32_t split_count() const { return static_cast<std::int32_t>(to_welded.size()); }
  std::int32_t welded_count() const { return static_cast<std::int32_t>(first_copy.size()); }
};

/// No welding: every vertex is its own only copy.
Weld no_weld(std::int32_t vertex_count);

/// Vertices that coincide (core/mesh/coincident.h) become copies of the same vertex, even if parts of the surface
/// merely touch there. A vertex with a NaN or infinite coordinate is never welded. `tolerance` is a share of the
/// diagonal, 0 to 1e-3; 0 means kSamePlace. The welded vertex has the position of its lowest copy. O(n) expected.
/// Errors, INVALID_ARGUMENT: WELD_TOLERANCE (NaN or out of range), WELD_TOO_DENSE (so many vertices lie within the
/// tolerance of each other that the search would take over 1000 distances per vertex).
absl::StatusOr<Weld> weld_by_position(const Points& positions, double tolerance = 0);

/// `groups` has one number per vertex; vertices with the same number become copies of the same vertex. The welded
/// vertex has the position of its lowest copy. Errors, INVALID_ARGUMENT: WELD_SIZE (not one number per vertex),
/// WELD_OUT_OF_RANGE (a number is not below the number of vertices), WELD_TOO_FAR (a copy is farther from the lowest
/// copy than 1e-6 of the diagonal of all vertices).
absl::StatusOr<Weld> weld_by_groups(const Points& positions, std::span<const std::uint32_t> groups);

/// The welded mesh: the same faces in the same order, with indices of welded vertices. An index that is out of range
/// stays as it is; it is out of range in the welded mesh as well.
TriangleMesh welded(const TriangleMesh& split, const Weld& weld);

/// Converts rows of welded vertices to rows of split vertices: copies get the same bits.
Points scattered(const Points& welded, const Weld& weld);
Field scattered(const Field& welded, const Weld& weld);

/// The report of the welded mesh in terms of the split mesh: split vertices are counted, and vertices are named by
/// their lowest copies.
MeshReport scattered(MeshReport welded, const Weld& weld);

}  // namespace lpdeform
