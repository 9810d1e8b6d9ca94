#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"

namespace lpdeform {

/// An edge, its lower vertex first, and what one pair of triangles adds to its weight.
struct WeightedEdge {
  std::array<std::int32_t, 2> edge;
  double weight;
};

/// A surface with its triangles drawn anew: same vertices, same metric, other edges.
struct IntrinsicDelaunay {
  /// Sorted. The same two vertices may come several times: several geodesics join them, their weights add up.
  /// Edges from a vertex to itself are left out: they carry no energy.
  std::vector<WeightedEdge> edges;
  /// Edges of the mesh that are not edges of this triangulation any more, ascending.
  std::vector<std::array<std::int32_t, 2>> flipped;
};

/// The intrinsic Delaunay triangulation of `mesh` and its cotangent weights (cot a + cot b) / 2 >= 0, for any
/// list of triangles with indices in range and at least one of some area:
///
/// 1. Every triangle is taken twice, front and back, and an edge of k triangles becomes k edges of two: the
///    tufted cover (Sharp & Crane 2020, "A Laplacian for Nonmanifold Triangle Meshes"). It has no boundary, is
///    manifold along edges and oriented, whatever the mesh is. Each copy counts half.
/// 2. Only edge lengths matter from here on. Where a triangle is flatter than b + c - a = 1e-5 h, h the mean
///    edge length, the least e that mends all of them is added to every length: e <= 1e-5 h, to rounding.
/// 3. While there is an edge with cot a + cot b < 0, it is flipped: the other diagonal of its two triangles,
///    laid out in the plane, replaces it (Fisher et al. 2007). This ends; a limit of 20 flips a side guards
///    against rounding, and what it would leave negative comes out negative.
///
/// Triangles with a repeated vertex take no part: their edges come with weight 0. O(m) flips in practice.
///
/// Cells take the straight chords p_i - p_j as rest edges, not the lengths along the surface: these alone leave
/// rigid motions without energy. On a mesh far from Delaunay a cell's chords may then join vertices that lie far from each other on the
/// mesh, and a whole strip come apart into cells that share too few of them to resist every bend: a strip sheared
/// 20-fold along itself becomes a chain without torsion, E = 3e-20 for a lift that costs 0.2 with clamped
/// cotangents. What it is worth: core/README.md. Preparing the shape takes several times as long.
IntrinsicDelaunay intrinsic_delaunay(const TriangleMesh& mesh);

}  // namespace lpdeform
