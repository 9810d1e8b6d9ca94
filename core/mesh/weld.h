#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/mesh/mesh.h"
#include "core/mesh/report.h"

namespace lpdeform {

/// Which vertices of a mesh are copies of one. Meshes that are made to be drawn have several vertices in one
/// place where texture coordinates or normals change along a seam; for a deformation they are one vertex, or
/// the surface would come apart there. The mesh as it is given is called split, the one with a vertex for
/// each place welded. Welded vertices are numbered by their lowest copies.
struct Weld {
  std::vector<std::int32_t> to_welded;   // one a split vertex
  std::vector<std::int32_t> first_copy;  // one a welded vertex: its lowest copy, ascending
  double same_place =
      0;  // what is said of copies' positions may differ by so much: kSamePlace of the diagonal

  std::int32_t split_count() const { return static_cast<std::int32_t>(to_welded.size()); }
  std::int32_t welded_count() const { return static_cast<std::int32_t>(first_copy.size()); }
};

/// Every vertex by itself.
Weld no_weld(std::int32_t vertex_count);

/// Vertices that coincide (core/mesh/coincident.h) are copies of one, also where parts of the surface merely
/// touch there; a vertex with a NaN or infinite coordinate is one by itself. `tolerance` is the share of the
/// diagonal, 0 to 1e-3; 0 is kSamePlace. The welded vertex lies where its lowest copy does. O(n) expected.
/// Errors, INVALID_ARGUMENT: WELD_TOLERANCE (NaN or out of range), WELD_TOO_DENSE (so many vertices lie within
/// the tolerance of each other that the search would not end: over 1000 distances a vertex).
absl::StatusOr<Weld> weld_by_position(const Points& positions, double tolerance = 0);

/// Vertices with the same number in `groups`, one a vertex, are copies of one. The welded vertex lies where
/// its lowest copy does. Errors, INVALID_ARGUMENT: WELD_SIZE (not one number a vertex), WELD_OUT_OF_RANGE (a
/// number is not below the number of vertices), WELD_TOO_FAR (a copy is over 1e-6 of the diagonal of all
/// vertices away from the lowest).
absl::StatusOr<Weld> weld_by_groups(const Points& positions, std::span<const std::uint32_t> groups);

/// The welded mesh: faces in the same order, their indices those of welded vertices; an index out of range
/// stays as it is, which is out of range there, too.
TriangleMesh welded(const TriangleMesh& split, const Weld& weld);

/// Rows of welded vertices as rows of split ones: copies get the same bits.
Points scattered(const Points& welded, const Weld& weld);
Field scattered(const Field& welded, const Weld& weld);

/// The report of the welded mesh for the owner of the split one: vertices are counted split, and named by
/// their lowest copies.
MeshReport scattered(MeshReport welded, const Weld& weld);

}  // namespace lpdeform
