#include "client/cli/files/outputs.h"

#include <algorithm>
#include <array>
#include <string>
#include <system_error>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/files/mesh_input.h"
#include "client/cli/files/text_file.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/io/mesh_io.h"
#include "core/io/obj_normals.h"

namespace lpdeform::cli {
namespace {

/// True also for different spellings of one path, such as ./a and a. Streams such as /dev/stdout never count
/// as the same file, so they may be given several times.
bool is_same_file(const std::filesystem::path& a, const std::filesystem::path& b) {
  std::error_code error;
  if (std::filesystem::exists(a, error) && !std::filesystem::is_regular_file(a, error)) return false;
  const auto whole = [&](const std::filesystem::path& path) {
    std::filesystem::path found =
        std::filesystem::weakly_canonical(std::filesystem::absolute(path, error), error);
    return error ? path : found;
  };
  return whole(a) == whole(b);
}

constexpr std::array<std::string_view, 6> kEndings{".glb", ".gltf", ".ply", ".obj", ".off", ".png"};

bool holds_normals(const std::filesystem::path& path) {
  return ending_of(path) == ".obj" || ending_of(path) == ".ply" || gltf::packing_of(path).has_value();
}

}  // namespace

absl::StatusOr<PictureStyle> picture_style(const PictureOptions& options) {
  PictureStyle style;
  if (options.size.size() == 2) style.width = options.size[0], style.height = options.size[1];
  style.red = options.red;
  if (!options.camera) return style;
  const auto file = read_deformable(*options.camera);
  if (!file.ok()) return said_of("--camera", file.status());
  const Faces& faces = file->mesh.faces;
  style.frame.resize(faces.size(), 3);
  for (Eigen::Index k = 0; k < faces.size(); ++k)
    style.frame.row(k) = file->mesh.vertices.row(faces.reshaped()[k]);
  return style;
}

absl::Status check_outputs(std::span<const std::filesystem::path> paths) {
  for (const std::filesystem::path& path : paths) {
    if (std::ranges::find(kEndings, ending_of(path)) == kEndings.end()) {
      return make_fault(
          {Reason::kOutFormatUnknown, path.string(), "ending = .glb, .gltf, .ply, .obj, .off or .png"},
          absl::StrCat("\"", path.string(), "\" ends in none of .glb, .gltf, .ply, .obj, .off and .png."));
    }
    absl::Status folder = check_folder(path);
    if (!folder.ok()) return folder;
  }
  return absl::OkStatus();
}

absl::Status check_apart(std::span<const NamedFile> written, std::span<const NamedFile> read) {
  std::vector<NamedFile> before(read.begin(), read.end());
  for (const NamedFile& file : written) {
    for (const NamedFile& other : before) {
      if (!is_same_file(file.path, other.path)) continue;
      return make_fault({Reason::kOutTwice, file.path.string(), "a file of its own"},
                        absl::StrCat("\"", file.path.string(), "\" is given for ", other.option, " and for ",
                                     file.option, "; it would be overwritten."));
    }
    before.push_back(file);
  }
  return absl::OkStatus();
}

absl::Status check_normals_have_output(std::span<const std::filesystem::path> paths) {
  if (std::ranges::any_of(paths, holds_normals)) return absl::OkStatus();
  return make_fault(
      {Reason::kOutWithoutNormals, "--normals", "an output that ends in .glb, .gltf, .obj or .ply"},
      "--normals is given, but no --out ends in .glb, .gltf, .obj or .ply, which hold normals.");
}

absl::Status write_output(const std::filesystem::path& path, const AnyMeshFile& file, const Points& positions,
                          const Beside& beside, const PictureStyle& style) {
  if (ending_of(path) != ".png") {
    const absl::Status status = write_any_mesh(path, file, positions, beside);
    return status.ok() ? status : said_of(path.string(), status);
  }
  PictureStyle with_colours = style;
  with_colours.distortion = beside.distortion;
  return render_png(path, file.mesh.faces, positions, with_colours);
}

}  // namespace lpdeform::cli
