#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/cli/files/handle_file.h"
#include "client/cpp/types.h"
#include "core/io/mesh_io.h"

namespace lpdeform::cli {

/// Where p and stiffness come from; what stands later below paints over what stands before.
struct MaterialOptions {
  double p = 2;
  std::optional<double> automatic;                       // strength: p and stiffness from the geometry
  std::optional<std::filesystem::path> p_field;          // in place of p
  std::optional<std::filesystem::path> stiffness_field;  // in place of 1, or of the geometry's
  std::vector<std::string> p_groups;                     // NAME=P
  std::vector<std::string> stiffness_groups;             // NAME=S
};

/// Reads what `options` name and sets p, and stiffness where it is not left at 1. `groups` are those of the
/// handle file; those of an OBJ mesh come after them. The server finds the automatic fields; only where groups
/// are painted over them they are found here, by the same code. `welding`: the tolerance where vertices are welded by position; a
/// group that names a copy has them all. Errors: as read_field and painting.h have them.
absl::Status read_material(const MaterialOptions& options, const MeshFile& file,
                           std::vector<VertexGroup> groups, std::optional<double> welding,
                           client::Settings& into);

/// The value of --p: a number from 1 to 64, "auto" (strength 1) or "auto:STRENGTH" with a strength from 0 to
/// 1. False where it is none of them.
bool parse_p(const std::string& text, MaterialOptions& options);

}  // namespace lpdeform::cli
