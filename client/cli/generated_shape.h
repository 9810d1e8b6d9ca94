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

std::vector<std::string> generated_shape_names();

}  // namespace lpdeform::cli
