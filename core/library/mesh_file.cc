#include "core/library/mesh_file.h"

#include <utility>

#include "core/gltf/any_mesh.h"
#include "core/library/convert.h"
#include "core/library/core.h"
#include "core/mesh/report.h"

namespace lpdeform::core {

struct MeshFile::Contents {
  AnyMeshFile file;
  Mesh mesh;
};

Result<MeshFile> MeshFile::read(const std::string& path) {
  auto file = read_any_mesh(path);
  if (!file.ok()) return error_of(file.status());
  Mesh mesh = given_back(file->mesh);
  return MeshFile(std::make_shared<Contents>(Contents{*std::move(file), std::move(mesh)}));
}

const Mesh& MeshFile::mesh() const {
  return contents_->mesh;
}

bool MeshFile::splits_vertices() const {
  return contents_->file.splits_vertices();
}

std::vector<MeshGroup> MeshFile::groups() const {
  std::vector<MeshGroup> groups;
  if (!contents_->file.gltf) return groups;
  for (gltf::NamedVertices& group : contents_->file.gltf->groups())
    groups.push_back({std::move(group.name), std::move(group.vertices)});
  return groups;
}

std::vector<MeshPart> MeshFile::parts() const {
  std::vector<MeshPart> parts;
  if (!contents_->file.gltf) return parts;
  for (gltf::Part& part : contents_->file.gltf->parts()) {
    parts.push_back({std::move(part.node), std::move(part.mesh), static_cast<std::size_t>(part.first),
                     static_cast<std::size_t>(part.count)});
  }
  return parts;
}

std::vector<std::string> MeshFile::notices() const {
  return contents_->file.gltf ? contents_->file.gltf->notices() : std::vector<std::string>();
}

Result<void> MeshFile::write(const std::string& path, const std::vector<double>& positions,
                             const WriteOptions& options) const {
  const AnyMeshFile& file = contents_->file;
  const auto own = points_of(positions, static_cast<std::int32_t>(file.mesh.vertices.rows()));
  if (!own.ok()) return error_of(own.status());
  std::optional<double> weld = options.weld;
  if (!weld && file.splits_vertices()) weld = 0;
  return result_of(write_any_mesh(path, file, *own, {.adds_normals = options.adds_normals, .weld = weld}));
}

Result<Mesh> read_mesh(const std::string& path) {
  const auto file = read_any_mesh(path);
  if (!file.ok()) return error_of(file.status());
  return given_back(file->mesh);
}

Result<void> write_mesh(const std::string& path, const Mesh& mesh) {
  auto own = converted(mesh);
  if (!own.ok()) return error_of(own.status());
  AnyMeshFile file;
  file.mesh = *std::move(own);
  return result_of(write_any_mesh(path, file, file.mesh.vertices, {}));
}

}  // namespace lpdeform::core
