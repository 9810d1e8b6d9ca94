#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/render/render.h"
#include "core/io/mesh_io.h"

namespace lpdeform::cli {

/// How .png outputs are to look: the same camera and colours for pictures that are to be compared.
struct PictureOptions {
  std::vector<int> size;                        // width and height in pixels; empty: PictureStyle's
  std::optional<std::filesystem::path> camera;  // a mesh: the camera is where a picture of it would have it
  double red = 0;                               // the distortion shown in full red; 0: by each picture
};

/// Errors: as read_mesh has them; MESH_EMPTY where no face of the camera's mesh can be seen.
absl::StatusOr<PictureStyle> picture_style(const PictureOptions& options);

/// INVALID_ARGUMENT where one of `paths` cannot become an output: an ending other than .ply, .obj, .off and
/// .png (OUT_FORMAT_UNKNOWN), or no such folder (FILE_NOT_WRITTEN). Asked before the solve, not after it.
absl::Status check_outputs(std::span<const std::filesystem::path> paths);

/// A file that the command line names, and as what.
struct NamedFile {
  std::string option;  // "--out"
  std::filesystem::path path;
};

/// INVALID_ARGUMENT OUT_TWICE where two of `written` are the same file, or one of them is also among `read`.
absl::Status check_apart(std::span<const NamedFile> written, std::span<const NamedFile> read);

/// INVALID_ARGUMENT OUT_WITHOUT_NORMALS where none of `paths` is to hold normals: .obj and .ply do.
absl::Status check_normals_have_output(std::span<const std::filesystem::path> paths);

/// Writes `positions` with the faces of `file`: .ply with distortion and colours, .obj keeping all else that
/// an OBJ input had, its normals turned with the surface, .off, or a picture as .png. `distortion` may be empty. `weld`:
/// see obj_text_with_normals.
absl::Status write_output(const std::filesystem::path& path, const MeshFile& file, const Points& positions,
                          const Field& distortion, std::optional<double> weld, const PictureStyle& style);

/// The same, .obj and .ply with normals, whatever the input had. `normals`: one a vertex, for .ply.
absl::Status write_output_with_normals(const std::filesystem::path& path, const MeshFile& file,
                                       const Points& positions, const Field& distortion,
                                       const Points& normals, std::optional<double> weld,
                                       const PictureStyle& style);

}  // namespace lpdeform::cli
