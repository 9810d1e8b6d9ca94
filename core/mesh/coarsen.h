#pragma once

#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"

namespace lpdeform {

/// A mesh with fewer vertices, all of them vertices of the fine one, and what became of the others.
struct CoarseMesh {
  TriangleMesh mesh;
  std::vector<std::int32_t> fine_vertex;    // of each coarse vertex
  std::vector<std::int32_t> coarse_vertex;  // of each fine vertex: the one that it went into
};

/// Collapses short edges into one of their ends, shortest first and in rounds of growing length, until about
/// `vertices` are left or no edge can go: spacing becomes even, boundaries stay boundaries, and no remaining face
/// turns by more than 60 degrees at a time, which keeps creases. Faces at which the mesh is not a manifold are left
/// out. For coarse levels, not for output. The same mesh gives the same result. O(n) for each factor of two.
CoarseMesh coarsen(const TriangleMesh& mesh, std::int32_t vertices);

}  // namespace lpdeform
