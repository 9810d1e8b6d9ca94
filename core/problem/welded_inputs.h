#pragma once

#include "absl/status/statusor.h"
#include "core/energy/material.h"
#include "core/mesh/weld.h"
#include "core/problem/handles.h"

namespace lpdeform {

// Converts inputs for the vertices of a split mesh to inputs for the welded mesh. One rule holds for all inputs:
// callers may name all copies of a vertex or only some, and the values for copies must be equal: target positions up to
// Weld::same_place, everything else to the last bit. Errors, INVALID_ARGUMENT: COPIES_DIFFER, which names two copies,
// and those listed below.

/// Each handle holds the welded vertices of its copies, each once, in the order in which they are first named. Points
/// inside faces do not change. The region contains every vertex of which it has a copy. Requires handles that
/// check_handles accepts for the split mesh. HANDLE_VERTEX_TWICE: two handles hold copies of the same vertex.
absl::StatusOr<HandleSet> welded(const HandleSet& split, const Weld& weld);

/// Fields with a single value do not change. Requires a material that check_material accepts for the split mesh.
absl::StatusOr<Material> welded(const Material& split, const Weld& weld);

/// `what` names the points in errors: "positions".
absl::StatusOr<Points> welded(const Points& split, const Weld& weld, std::string_view what);

}  // namespace lpdeform
