#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/files/handle_file.h"
#include "core/mesh/mesh.h"

namespace lpdeform::cli {

/// A shape to try things on, with handles that deform it.
struct GeneratedShape {
  TriangleMesh mesh;
  std::vector<NamedHandle> handles;
  std::string note;  // what the handles do
};

/// `detail` >= 1 multiplies the cells along each side. INVALID_ARGUMENT: SHAPE_UNKNOWN lists the shapes that
/// exist, SHAPE_DETAIL.
absl::StatusOr<GeneratedShape> generate_shape(std::string_view name, int detail);
/// The same shape with about this many vertices, from those at detail 1 to five million: within 15 %, and from 15,000 on
/// within 5 %. A sphere has 10 * 4^k + 2, up to 2,621,442. INVALID_ARGUMENT: SHAPE_UNKNOWN, SHAPE_DETAIL.
absl::StatusOr<GeneratedShape> generate_shape_of(std::string_view name, int vertices);

std::vector<std::string> generated_shape_names();

}  // namespace lpdeform::cli
