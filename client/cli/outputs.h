#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "core/mesh/io.h"

namespace lpdeform::cli {

/// INVALID_ARGUMENT where one of `paths` cannot become an output: an ending other than .ply, .obj, .off and
/// .png (OUT_FORMAT_UNKNOWN), or no such folder (FILE_NOT_WRITTEN). Asked before the solve, not after it.
absl::Status check_outputs(std::span<const std::filesystem::path> paths);

/// INVALID_ARGUMENT OUT_WITHOUT_NORMALS where none of `paths` is to hold normals: .obj and .ply do.
absl::Status check_normals_have_output(std::span<const std::filesystem::path> paths);

/// Writes `positions` with the faces of `file`: .ply with distortion and colours, .obj keeping all else that
/// an OBJ input had, its normals turned with the surface, .off, or a picture as .png. `distortion` may be empty. `weld`:
/// see obj_text_with_normals.
absl::Status write_output(const std::filesystem::path& path, const MeshFile& file, const Points& positions,
                          const Field& distortion, std::optional<double> weld);

/// The same, .obj and .ply with normals, whatever the input had. `normals`: one a vertex, for .ply.
absl::Status write_output_with_normals(const std::filesystem::path& path, const MeshFile& file,
                                       const Points& positions, const Field& distortion,
                                       const Points& normals, std::optional<double> weld);

}  // namespace lpdeform::cli
