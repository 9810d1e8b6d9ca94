#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"

namespace lpdeform {

/// An edge, lower vertex first, and the contribution of one pair of triangles to its weight.
struct WeightedEdge {
  std::array<std::int32_t, 2> edge;
  double weight;
};

/// Another triangulation of a surface: same vertices, same metric, different edges.
struct IntrinsicDelaunay {
  /// Sorted. The same pair of vertices may occur several times if several geodesics join it; their weights add up.
  /// Edges from a vertex to itself are left out, because they carry no energy.
  std::vector<WeightedEdge> edges;
  /// Edges of the mesh that are not edges of this triangulation, ascending.
  std::vector<std::array<std::int32_t, 2>> flipped;
};

/// The intrinsic Delaunay triangulation of `mesh` and its cotangent weights (cot a + cot b) / 2 >= 0, for any
/// list of triangles with indices in range and at least one of some area:
///
/// 1. The tufted cover (Sharp & Crane 2020, "A Laplacian for Nonmanifold Triangle Meshes"): every triangle is
///    taken twice, front and back, and an edge of k triangles becomes k edges of two triangles each. The cover
///    has no boundary, is manifold along edges and oriented, whatever the mesh is. Each copy counts half.
/// 2. From here on only edge lengths matter. A triangle with sides a >= b, c is too flat if b + c - a < 1e-5 h,
///    h the mean edge length. The least e that corrects all flat triangles is added to every length:
///    e <= 1e-5 h, to rounding.
/// 3. While there is an edge with cot a + cot b < 0, it is flipped: the other diagonal of its two triangles,
///    laid out in the plane, replaces it (Fisher et al. 2007). This terminates. A limit of 20 flips per side
///    guards against rounding; edges that are still negative at the limit keep their negative weights.
///
/// Triangles with a repeated vertex are skipped: their edges get weight 0. O(m) flips in practice.
///
/// Cells use the straight chords p_i - p_j as rest edges, not the geodesic lengths, because only with chords do rigid
/// motions have no energy. On a mesh far from Delaunay, a cell's chords may then join vertices that are far apart on
/// the mesh. A strip may break up into cells that share too few vertices to resist every bend: a strip sheared 20-fold
/// along itself becomes a chain without torsion, where a lift that costs 0.2 with clamped cotangents has E = 3e-20.
/// Measured benefit: core/rooms.md. Preparing the shape takes several times as long as with cotangent weights.
IntrinsicDelaunay intrinsic_delaunay(const TriangleMesh& mesh);

}  // namespace lpdeform
