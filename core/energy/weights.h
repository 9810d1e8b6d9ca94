#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"
#include "core/mesh/report.h"

namespace lpdeform {

enum class WeightKind {
  kCotangent,  // max(0, (cot a + cot b) / 2), a and b the angles opposite the edge
  kUniform,    // 1 on every edge
  /// Cotangents of the intrinsic Delaunay triangulation (core/energy/intrinsic_delaunay.h), which are never
  /// negative. The cells' edges are that triangulation's: neighbours need not share an edge of the mesh. Rest
  /// edges stay the straight ones, p_i - p_j, so that rigid motions have no energy.
  kIntrinsicDelaunay,
};

/// Edges and their weights, each edge once with its lower vertex first, sorted.
struct EdgeWeights {
  std::vector<std::array<std::int32_t, 2>> edges;
  std::vector<double> weights;                 // >= 0, same order
  std::vector<std::int32_t> clamped_edges;     // indices into `edges`: the cotangent sum was negative
  std::vector<std::int32_t> floored_vertices;  // ascending; see below
  /// Edges of the mesh that gave way to others: of kIntrinsicDelaunay alone.
  std::vector<std::array<std::int32_t, 2>> flipped_edges;
};

/// Weights of the edges of a mesh that deformable() accepts. A non-manifold edge takes half the sum of the
/// cotangents of all its faces, then the clamp. A zero-area face adds nothing. A part of
/// the surface (mostly one vertex) that hangs on edges below 1e-6 times the mean weight alone is kept attached:
/// those edges get that much. The mean leaves out weights over 1000 times the median.
///
/// kIntrinsicDelaunay flips nothing where no edge would be clamped and no face has zero area: its weights are
/// then those of kCotangent, to the last bit. Otherwise no edge is clamped, whatever the mesh is; zero-area
/// faces count as very thin ones.
EdgeWeights edge_weights(const TriangleMesh& mesh, WeightKind kind);

/// Writes the clamped and flipped edges and the floored vertices of `weights` into `report`.
void count_weight_defects(const EdgeWeights& weights, MeshReport& report);

}  // namespace lpdeform
