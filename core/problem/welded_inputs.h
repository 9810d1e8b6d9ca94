#pragma once

#include "absl/status/statusor.h"
#include "core/energy/material.h"
#include "core/mesh/weld.h"
#include "core/problem/handles.h"

namespace lpdeform {

// What the owner of a split mesh says about its vertices, said about the welded ones. One rule for all of it:
// copies of a vertex may be named each or in part, and what is said of them must be the same: target positions up to
// Weld::same_place, the rest to the last bit.
// Errors, INVALID_ARGUMENT: COPIES_DIFFER, naming two copies; and what is listed below.

/// Each handle holds the vertices that its copies belong to, each once, in the order in which they are first
/// named; points inside faces stay. The region
/// has every vertex of which it has a copy. Needs handles that check_handles accepts for the split mesh. HANDLE_VERTEX_TWICE: two handles hold
/// copies of one vertex.
absl::StatusOr<HandleSet> welded(const HandleSet& split, const Weld& weld);

/// Fields of one value stay as they are. Needs a material that check_material accepts for the split mesh.
absl::StatusOr<Material> welded(const Material& split, const Weld& weld);

/// `what` names the points in errors: "positions".
absl::StatusOr<Points> welded(const Points& split, const Weld& weld, std::string_view what);

}  // namespace lpdeform
