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
};

/// Edges and their weights, each edge once with its lower vertex first, sorted.
struct EdgeWeights {
  std::vector<std::array<std::int32_t, 2>> edges;
  std::vector<double> weights;                 // >= 0, same order
  std::vector<std::int32_t> clamped_edges;     // indices into `edges`: the cotangent sum was negative
  std::vector<std::int32_t> floored_vertices;  // ascending; see below
};

/// Weights of the edges of a mesh that deformable() accepts. A non-manifold edge takes half the sum of the
/// cotangents of all its faces, then the clamp. A zero-area face adds nothing. A vertex whose weights would
/// all be 0 (or below 1e-6 of the mean weight) is kept attached: every edge of it gets at least 1e-6 times
/// the mean weight.
EdgeWeights edge_weights(const TriangleMesh& mesh, WeightKind kind);

/// Writes the clamped edges and floored vertices of `weights` into `report`.
void count_weight_defects(const EdgeWeights& weights, MeshReport& report);

}  // namespace lpdeform
