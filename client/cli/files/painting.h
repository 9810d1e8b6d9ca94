#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/files/handle_file.h"

namespace lpdeform::cli {

/// A value for the vertices of a group: "NAME=VALUE" on the command line.
struct Paint {
  std::string group;
  double value = 0;
};

/// INVALID_ARGUMENT (PAINT_SYNTAX) where `text` is not a name, '=' and a number; the name may contain '='.
absl::StatusOr<Paint> parse_paint(std::string_view text);

/// The groups of an OBJ file: for each name on a "g" or "o" line the vertices of the faces after it,
/// ascending, each once. A "g" line may have several names; groups without a face are left out. `obj_source`
/// must have been read as a mesh before.
std::vector<VertexGroup> obj_groups(std::string_view obj_source);

/// Fields of one value a vertex, painted: in this order the p and stiffness that `groups` have themselves,
/// then `p_paints` and `stiffness_paints` as given; what comes later covers what came before. Where nothing
/// paints a field it stays as it is. `p` and `stiffness` may be uniform (one value) or per vertex before.
/// NOT_FOUND (GROUP_UNKNOWN) names the groups there are.
struct PaintedFields {
  std::vector<double> p, stiffness;
};
absl::Status paint(const std::vector<VertexGroup>& groups, const std::vector<Paint>& p_paints,
                   const std::vector<Paint>& stiffness_paints, std::int64_t vertex_count,
                   PaintedFields& fields);

}  // namespace lpdeform::cli
