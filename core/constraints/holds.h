#pragma once

#include <string>
#include <vector>

#include "core/constraints/linear_constraints.h"
#include "core/constraints/soft_terms.h"
#include "core/energy/rest_shape.h"
#include "core/problem/handles.h"

namespace lpdeform {

/// What handles require of the positions of vertices that are not held: Soft and Orientation as soft terms; locks, and
/// Exactly for points inside faces, as rows. All in scaled units.
struct Holds {
  SoftTerms soft;
  std::vector<LinearRow> rows;
};

/// Vertex or point k of a handle as a function of positions.
PointForm point_form(const RestShape& shape, const Handle& handle, std::size_t k);

/// Adds the terms and rows of `handle`; none for vertices held Exactly or for a weight of 0. `targets` are
/// target_positions in scaled units.
void add_holds(const RestShape& shape, const std::string& name, const Handle& handle, const Points& targets,
               Holds& holds);

/// Whether some handle puts equations on positions: points held exactly, and locks.
bool has_equations(const HandleSet& handles);

/// How far a hold keeps the component of its vertices from drifting off.
enum class Tie {
  kNone,     // not at all: an orientation, or a soft weight of 0
  kPartial,  // in some directions only: a lock
  kWhole,    // in all directions
};

Tie tie_of(const Hold& hold);

}  // namespace lpdeform
