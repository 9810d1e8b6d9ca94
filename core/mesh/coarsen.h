#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/mesh/mesh.h"

namespace lpdeform {

/// A mesh whose vertices are a subset of the fine mesh's vertices, and the mapping of the others.
struct CoarseMesh {
  TriangleMesh mesh;
  std::vector<std::int32_t> fine_vertex;    // of each coarse vertex
  std::vector<std::int32_t> coarse_vertex;  // of each fine vertex: the one that it was collapsed into

  std::size_t memory_bytes() const;
};

/// Collapses short edges into one of their ends, in rounds of growing edge length, until about `vertices` vertices are
/// left or no edge can be collapsed. The vertex spacing becomes even, boundaries stay boundaries, and no remaining face
/// turns by more than 60 degrees in one collapse, which preserves creases. Faces with the half-edge of an
/// earlier face are left out, and a vertex that joins several fans of faces stays. Vertices that are marked in `stays` stay, too; it has
/// one mark for each vertex, or none. The result is for coarse levels, not for output. Deterministic. O(n) for each factor of two.
CoarseMesh coarsen(const TriangleMesh& mesh, std::int32_t vertices, const std::vector<char>& stays = {});

}  // namespace lpdeform
