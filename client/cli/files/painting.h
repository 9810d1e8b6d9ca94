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

/// Parses a name, '=' and a number; the name may contain '='. INVALID_ARGUMENT (PAINT_SYNTAX) for anything
/// else.
absl::StatusOr<Paint> parse_paint(std::string_view text);

/// The groups of an OBJ file. Each name on a "g" or "o" line has the vertices of the faces after it,
/// ascending and without repetition. A "g" line may have several names. Groups without a face are omitted.
/// `obj_source` must have been read as a mesh before.
std::vector<VertexGroup> obj_groups(std::string_view obj_source);

/// Fields with one value per vertex, painted in this order: the p and stiffness of `groups` themselves, then
/// `p_paints` and `stiffness_paints` as given. Later values cover earlier ones. A field that nothing paints
/// stays as it is. Before painting, `p` and `stiffness` may be uniform (one value) or per vertex. NOT_FOUND
/// (GROUP_UNKNOWN) lists the groups that exist.
struct PaintedFields {
  std::vector<double> p, stiffness;
};
absl::Status paint(const std::vector<VertexGroup>& groups, const std::vector<Paint>& p_paints,
                   const std::vector<Paint>& stiffness_paints, std::int64_t vertex_count,
                   PaintedFields& fields);

}  // namespace lpdeform::cli
