#pragma once

#include <cstdint>
#include <vector>

#include "core/constraints/constraints.h"
#include "core/energy/rest_shape.h"
#include "core/problem/handles.h"

namespace lpdeform {

/// A fine shape and a coarse one made of some of its vertices.
struct LevelPair {
  const RestShape& fine;
  const RestShape& coarse;
  const std::vector<std::int32_t>& fine_vertex;    // of each coarse vertex
  const std::vector<std::int32_t>& coarse_vertex;  // of each fine vertex: the one that it went into
};

/// Handles that ask of the coarse shape what `handles` ask of the fine one. Every coarse vertex that the fine level holds
/// is held where it is there; every other handle keeps its kind, on those of its vertices that are coarse ones,
/// or, where none is, on those that its own went into, and on the coarse faces nearest to its points. Soft weights
/// grow as vertices get fewer. Where two handles come to the same vertex, the first has it.
HandleSet coarse_handles(const LevelPair& levels, const HandleSet& handles, const Constraints& constraints);

}  // namespace lpdeform
