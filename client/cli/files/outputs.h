#pragma once

#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/files/mesh_input.h"
#include "client/cli/render/render.h"

namespace lpdeform::cli {

/// How .png outputs are drawn. Pictures that are to be compared need the same camera and colours.
struct PictureOptions {
  std::vector<int> size;                        // width and height in pixels; empty: PictureStyle's
  std::optional<std::filesystem::path> camera;  // a mesh: pictures are framed as for this mesh
  double red = 0;  // the distortion shown in full red; 0: each picture's own largest
};

/// Errors: those of read_mesh; MESH_EMPTY if no face of the camera's mesh is visible.
absl::StatusOr<PictureStyle> picture_style(const PictureOptions& options);

/// INVALID_ARGUMENT if one of `paths` cannot be written: its ending is not .glb, .gltf, .ply, .obj,
/// .off or .png (OUT_FORMAT_UNKNOWN), or its folder does not exist (FILE_NOT_WRITTEN). Check this before the solve, not
/// after it.
absl::Status check_outputs(std::span<const std::filesystem::path> paths);

/// A file on the command line, and the option that names it.
struct NamedFile {
  std::string option;  // "--out"
  std::filesystem::path path;
};

/// INVALID_ARGUMENT OUT_TWICE if two of `written` are the same file, or if one of them is also in `read`.
absl::Status check_apart(std::span<const NamedFile> written, std::span<const NamedFile> read);

/// INVALID_ARGUMENT OUT_WITHOUT_NORMALS if none of `paths` can hold normals; .glb, .gltf, .obj and .ply can.
absl::Status check_normals_have_output(std::span<const std::filesystem::path> paths);

/// Writes `positions`: a mesh file as write_any_mesh() does, or a picture as .png, coloured by the distortion.
absl::Status write_output(const std::filesystem::path& path, const AnyMeshFile& file, const Points& positions,
                          const Beside& beside, const PictureStyle& style);

}  // namespace lpdeform::cli
