#include "core/gltf/any_mesh.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/io/obj_normals.h"
#include "core/io/whole_file.h"
#include "core/mesh/report.h"
#include "core/mesh/weld.h"

namespace lpdeform {
namespace {

/// A glTF input with new positions; from another format, a new glTF with the mesh alone.
absl::Status write_gltf(const std::filesystem::path& path, gltf::Packing packing, const AnyMeshFile& file,
                        const Points& positions, const Beside& beside) {
  if (!file.gltf) {
    const absl::Status status = deformable(check_mesh(file.mesh));
    if (!status.ok()) return status;
  }
  const absl::StatusOr<gltf::Gltf> source = file.gltf ? *file.gltf : gltf::Gltf::of_mesh(file.mesh);
  if (!source.ok()) return source.status();
  const auto bytes = source->bytes(positions, packing, beside.weld, beside.adds_normals);
  return bytes.ok() ? write_whole_file(path, *bytes) : bytes.status();
}

absl::Status write_obj(const std::filesystem::path& path, const MeshFile& file, const Points& positions,
                       const Beside& beside) {
  if (!beside.adds_normals && !has_obj_normals(file)) return write_mesh(path, file, positions, Field());
  absl::Status status = deformable(check_mesh(file.mesh));
  if (status.ok() && beside.weld) status = weld_by_position(file.mesh.vertices, *beside.weld).status();
  if (!status.ok()) return status;
  return write_whole_file(path, obj_text_with_normals(file, positions, beside.weld));
}

absl::Status unknown(const std::filesystem::path& path, const char* endings, const char* why) {
  return make_fault({Reason::kMeshFormatUnknown, path.string(), absl::StrCat("one of ", endings)},
                    absl::StrCat("The name ", path.string(), why, endings, "."));
}

absl::Status check_finite(const Points& positions) {
  for (Eigen::Index vertex = 0; vertex < positions.rows(); ++vertex) {
    if (positions.row(vertex).allFinite()) continue;
    return make_fault({Reason::kMeshNotFinite, absl::StrCat("vertex ", vertex), "finite coordinates"},
                      absl::StrCat("The position of vertex ", vertex, " is NaN or infinite."));
  }
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<AnyMeshFile> read_any_mesh(const std::filesystem::path& path) {
  if (gltf::packing_of(path)) {
    auto read = gltf::Gltf::read(path);
    if (!read.ok()) return read.status();
    return AnyMeshFile{{read->mesh(), ""}, *std::move(read)};
  }
  if (!mesh_format(path).ok())
    return unknown(path, ".glb, .gltf, .off, .obj, .ply, .stl", " ends in none of ");
  absl::StatusOr<MeshFile> file = read_mesh(path);
  if (!file.ok()) return file.status();
  return AnyMeshFile{*std::move(file), {}};
}

absl::Status write_any_mesh(const std::filesystem::path& path, const AnyMeshFile& file,
                            const Points& positions, const Beside& beside) {
  const auto packing = gltf::packing_of(path);
  const auto format = mesh_format(path);
  if (!packing && (!format.ok() || *format == MeshFormat::kStl)) {
    return unknown(
        path, ".glb, .gltf, .off, .obj, .ply",
        format.ok() ? " is one of an STL file, which keeps no vertices; use one of " : " ends in none of ");
  }
  absl::Status status = check_finite(positions);
  if (!status.ok()) return status;
  if (packing) return write_gltf(path, *packing, file, positions, beside);
  if (*format == MeshFormat::kObj) return write_obj(path, file, positions, beside);
  return write_mesh(path, file, positions, beside.distortion, beside.normals);
}

}  // namespace lpdeform
