#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/cli/files/handle_file.h"
#include "client/cli/files/mesh_input.h"
#include "client/cpp/types.h"

namespace lpdeform::cli {

/// Where p and stiffness come from. A member further down overrides those above it.
struct MaterialOptions {
  double p = 2;
  std::optional<double> automatic;               // strength: p and stiffness from the geometry
  std::optional<std::filesystem::path> p_field;  // instead of p
  std::optional<std::filesystem::path>
      stiffness_field;                        // instead of 1, or of the stiffness from the geometry
  std::vector<std::string> p_groups;          // NAME=P
  std::vector<std::string> stiffness_groups;  // NAME=S
};

/// Reads the inputs that `options` name and sets p, and stiffness unless it stays 1. `groups`: those of the
/// handle file; those of an OBJ or glTF mesh are added. The server finds the automatic fields. Only if groups are
/// painted over them, they are found here, by the same code. `welding`: the tolerance if vertices are welded
/// by position; a group that names one copy of a vertex then has all copies. Errors: those of read_field and
/// painting.h.
absl::Status read_material(const MaterialOptions& options, const AnyMeshFile& file,
                           std::vector<VertexGroup> groups, std::optional<double> welding,
                           client::Settings& into);

/// Parses the value of --p: a number from 1 to 64, "auto" (strength 1) or "auto:STRENGTH" with a strength
/// from 0 to 1. Returns false for anything else.
bool parse_p(const std::string& text, MaterialOptions& options);

}  // namespace lpdeform::cli
