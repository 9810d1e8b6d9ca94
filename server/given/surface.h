#pragma once

#include <memory>

#include "absl/status/status.h"
#include "core/energy/weights.h"
#include "core/mesh/mesh.h"
#include "core/mesh/weld.h"
#include "server/session/session.h"

namespace lpdeform {

/// A mesh with what belongs to it, as a caller gives it.
struct GivenSurface {
  TriangleMesh mesh;
  Points normals = Points(0, 3);          // one per vertex, or no rows
  std::shared_ptr<const Weld> weld = {};  // null: nothing is welded
  WeightKind weights = WeightKind::kCotangent;
};

/// Makes `shape` and `mesh` of `parts`. INVALID_ARGUMENT if the mesh cannot be deformed; the error names the
/// caller's vertices where that is possible.
absl::Status make_surface(GivenSurface given, const Workers& workers, SessionParts& parts);

/// Makes `deformer` and `features` of `parts` from its shape and free_components. Errors: those of
/// Deformer::create, and of `admit`, which may be empty.
absl::Status make_deformer(int threads, std::function<absl::Status(std::size_t bytes)> admit,
                           SessionParts& parts);

}  // namespace lpdeform
