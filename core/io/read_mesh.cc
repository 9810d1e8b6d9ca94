#include <cctype>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/io/mesh_io.h"
#include "core/io/readers.h"
#include "core/io/whole_file.h"

namespace lpdeform {
namespace {

absl::StatusOr<TriangleMesh> parse_triangles(std::string_view bytes, MeshFormat format) {
  switch (format) {
    case MeshFormat::kOff:
      return parse_off(bytes);
    case MeshFormat::kObj:
      return parse_obj(bytes);
    case MeshFormat::kPly:
      return parse_ply(bytes);
    case MeshFormat::kStl:
      return parse_stl(bytes);
  }
  return absl::InternalError("not a mesh format");
}

}  // namespace

std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

absl::StatusOr<MeshFormat> mesh_format(const std::filesystem::path& path) {
  const std::string ending = ending_of(path);
  if (ending == ".off") return MeshFormat::kOff;
  if (ending == ".obj") return MeshFormat::kObj;
  if (ending == ".ply") return MeshFormat::kPly;
  if (ending == ".stl") return MeshFormat::kStl;
  return make_fault({Reason::kMeshFormatUnknown, path.string(), "one of .off, .obj, .ply, .stl"},
                    absl::StrCat("The name ", path.string(), " ends in none of .off, .obj, .ply and .stl."));
}

absl::StatusOr<MeshFile> parse_mesh(std::string_view bytes, MeshFormat format) {
  absl::StatusOr<TriangleMesh> mesh = parse_triangles(bytes, format);
  if (!mesh.ok()) return mesh.status();
  return MeshFile{*std::move(mesh), format == MeshFormat::kObj ? std::string(bytes) : std::string()};
}

absl::StatusOr<MeshFile> read_mesh(const std::filesystem::path& path) {
  const absl::StatusOr<MeshFormat> format = mesh_format(path);
  if (!format.ok()) return format.status();
  const absl::StatusOr<std::string> bytes = read_whole_file(path);
  if (!bytes.ok()) return bytes.status();
  return parse_mesh(*bytes, *format);
}

}  // namespace lpdeform
