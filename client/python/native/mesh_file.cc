#include "client/python/native/mesh_file.h"

#include <utility>
#include <vector>

namespace lpdeform::python {
namespace {

/// A view of `numbers`, which `owner` keeps.
template <typename Number, typename Owner>
nb::object view(const Number* numbers, std::size_t rows, const std::shared_ptr<Owner>& owner) {
  const nb::capsule kept(new std::shared_ptr<Owner>(owner), [](void* pointer) noexcept {
    delete static_cast<std::shared_ptr<Owner>*>(pointer);
  });
  return nb::cast(nb::ndarray<nb::numpy, const Number>(numbers, {rows, 3}, kept));
}

nb::object array(const std::vector<std::uint32_t>& numbers) {
  const auto owner = std::make_shared<const std::vector<std::uint32_t>>(numbers);
  const nb::capsule kept(new std::shared_ptr<const std::vector<std::uint32_t>>(owner),
                         [](void* pointer) noexcept {
                           delete static_cast<std::shared_ptr<const std::vector<std::uint32_t>>*>(pointer);
                         });
  return nb::cast(nb::ndarray<nb::numpy, const std::uint32_t>(owner->data(), {owner->size()}, kept));
}

}  // namespace

nb::object LocalMeshFile::vertices() const {
  const Points& vertices = file_->mesh.vertices;
  return view(vertices.data(), static_cast<std::size_t>(vertices.rows()), file_);
}

nb::object LocalMeshFile::faces() const {
  const Faces& faces = file_->mesh.faces;
  return view(faces.data(), static_cast<std::size_t>(faces.rows()), file_);
}

nb::object LocalMeshFile::groups() const {
  nb::dict groups;
  if (!file_->gltf) return groups;
  for (const gltf::NamedVertices& group : file_->gltf->groups())
    groups[nb::str(group.name.data(), group.name.size())] = array(group.vertices);
  return groups;
}

nb::object LocalMeshFile::parts() const {
  nb::list parts;
  if (!file_->gltf) return parts;
  for (const gltf::Part& part : file_->gltf->parts())
    parts.append(nb::make_tuple(part.node, part.mesh, part.first, part.count));
  return parts;
}

nb::object LocalMeshFile::notices() const {
  nb::list notices;
  if (!file_->gltf) return notices;
  for (const std::string& notice : file_->gltf->notices()) notices.append(notice);
  return notices;
}

void LocalMeshFile::write(const std::string& path, const Numbers3& positions, bool adds_normals,
                          std::optional<double> weld) const {
  const Points points = points_of(positions);
  const nb::gil_scoped_release released;
  require(write_any_mesh(path, *file_, points, {.adds_normals = adds_normals, .weld = weld}));
}

std::unique_ptr<LocalMeshFile> read_mesh_file(const std::string& path) {
  const nb::gil_scoped_release released;
  return std::make_unique<LocalMeshFile>(required(read_any_mesh(path)));
}

void write_mesh_file(const std::string& path, const Numbers3& vertices, const Indices3& faces) {
  AnyMeshFile file;
  file.mesh = mesh_of(vertices, faces);
  const nb::gil_scoped_release released;
  require(write_any_mesh(path, file, file.mesh.vertices, {}));
}

}  // namespace lpdeform::python
