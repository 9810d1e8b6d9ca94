#pragma once

#include <cstdint>
#include <vector>

#include "core/constraints/constraints.h"
#include "core/energy/rest_shape.h"
#include "core/problem/handles.h"

namespace lpdeform {

/// A fine shape, and a coarse shape whose vertices are a subset of its vertices.
struct LevelPair {
  const RestShape& fine;
  const RestShape& coarse;
  const std::vector<std::int32_t>& fine_vertex;    // of each coarse vertex
  const std::vector<std::int32_t>& coarse_vertex;  // of each fine vertex: the one that it was collapsed into
};

/// Restricts `handles` from the fine shape to the coarse one. Every coarse vertex that is held in the fine level is
/// held at the same place. All other handles keep their kind. Such a handle acts on those of its vertices that are
/// coarse vertices; if there is none, on the coarse vertices that its vertices were collapsed into. Its points move to
/// the nearest coarse faces. Soft weights grow in proportion as the number of vertices falls. If two handles want the
/// same coarse vertex, the first gets it.
HandleSet coarse_handles(const LevelPair& levels, const HandleSet& handles, const Constraints& constraints);

}  // namespace lpdeform
