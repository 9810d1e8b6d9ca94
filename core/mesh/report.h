#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/mesh/mesh.h"

namespace lpdeform {

/// The kinds of defect that a report counts.
enum class Defect {
  kNotFinite,                // element: vertex. A NaN or infinite coordinate. Refused.
  kIndexOutOfRange,          // face. Refused.
  kUnreferencedVertex,       // vertex. Stays where it is.
  kDuplicateFace,            // face: same three vertices as an earlier face, in any order
  kZeroAreaFace,             // face: repeated vertex, or area 0 to rounding. Adds no weight.
  kNonManifoldEdge,          // edge: more than two faces
  kNonManifoldVertex,        // vertex: its faces do not form one fan
  kInconsistentOrientation,  // edge: its two faces run along it in the same direction
  kSplitBorderVertex,  // vertex: at a border, coincides with another at a border. Splits open unless welded.
  kClampedEdge,        // edge: negative cotangent weight, clamped to 0
  kFlooredVertex,      // vertex: kept attached by the floor on edge weights
  kFlippedEdge,        // edge: not Delaunay; replaced by another edge with intrinsic Delaunay weights
};

/// The name in reports and on the wire: "zero_area_faces".
std::string_view defect_name(Defect defect);

/// The number of defects of one kind, and the first few by index (edges as pairs: 2 entries per edge, lower index
/// first).
struct DefectCount {
  std::int64_t count = 0;
  std::vector<std::int32_t> first;

  static constexpr int kFirstShown = 10;
};

/// What a caller should know about a mesh before deforming it.
struct MeshReport {
  std::int64_t vertices = 0;
  std::int64_t faces = 0;
  std::int64_t edges = 0;
  std::int64_t components = 0;  // connected by edges; unreferenced vertices are not counted
  std::int64_t boundary_loops = 0;

  DefectCount not_finite, index_out_of_range, unreferenced_vertices, duplicate_faces, zero_area_faces,
      non_manifold_edges, non_manifold_vertices, inconsistent_orientation, split_border_vertices;
  std::int32_t wrong_index = 0;  // the wrong index of the first face in index_out_of_range
  /// Set when weights are computed (count_weight_defects in core/energy/weights.h); 0 before.
  DefectCount clamped_edges, floored_vertices, flipped_edges;

  const DefectCount& of(Defect defect) const;
  DefectCount& of(Defect defect);
};

/// Every kind of defect, in the order of the enum.
const std::vector<Defect>& all_defects();

/// Examines `mesh`. Never fails, even if the mesh cannot be deformed. O(n + m log m).
MeshReport check_mesh(const TriangleMesh& mesh);

/// INVALID_ARGUMENT with the first offending element if the mesh cannot be deformed. Reasons: MESH_EMPTY,
/// MESH_NOT_FINITE, MESH_INDEX_OUT_OF_RANGE, MESH_NO_AREA (every face has zero area to rounding, see topology.h).
absl::Status deformable(const MeshReport& report);

/// The connected component of each vertex, numbered from 0 by lowest vertex; -1 for unreferenced vertices. Requires
/// faces with indices in range.
std::vector<std::int32_t> connected_components(const TriangleMesh& mesh);

}  // namespace lpdeform
