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
  /// Cotangent weights of the intrinsic Delaunay triangulation (core/energy/intrinsic_delaunay.h), which are never
  /// negative. The cells' edges are those of that triangulation: neighbours need not share an edge of the mesh. Rest
  /// edges remain the straight chords p_i - p_j, so that rigid motions have no energy.
  kIntrinsicDelaunay,
};

/// Edges and their weights. Each edge occurs once, lower vertex first; sorted.
struct EdgeWeights {
  std::vector<std::array<std::int32_t, 2>> edges;
  std::vector<double> weights;                 // >= 0, same order
  std::vector<std::int32_t> clamped_edges;     // indices into `edges`: the cotangent sum was negative
  std::vector<std::int32_t> floored_vertices;  // ascending; see below
  /// Edges of the mesh that flips have replaced; only with kIntrinsicDelaunay.
  std::vector<std::array<std::int32_t, 2>> flipped_edges;
};

/// Weights of the edges of a mesh that deformable() accepts. A non-manifold edge gets half the sum of the cotangents of
/// all its faces, clamped to >= 0. A zero-area face adds nothing. If a part of the surface (usually one vertex) is
/// attached only by edges with weights below 1e-6 times the mean weight, these edges get that weight (the floor), so
/// that the part stays attached. The mean excludes weights over 1000 times the median.
///
/// If no edge would be clamped and no face has zero area, kIntrinsicDelaunay flips nothing, and its weights equal those
/// of kCotangent bit for bit. Otherwise it flips edges; then no edge is clamped, whatever the mesh is, and zero-area
/// faces count as very thin ones.
EdgeWeights edge_weights(const TriangleMesh& mesh, WeightKind kind);

/// Writes the clamped and flipped edges and the floored vertices of `weights` into `report`.
void count_weight_defects(const EdgeWeights& weights, MeshReport& report);

}  // namespace lpdeform
