#pragma once

#include <memory>
#include <optional>

#include "client/python/native/values.h"
#include "core/gltf/any_mesh.h"

namespace lpdeform::python {

/// A mesh file as it was read. lpdeform/mesh_files.py is its only user. Immutable.
class LocalMeshFile {
 public:
  explicit LocalMeshFile(AnyMeshFile file) : file_(std::make_shared<const AnyMeshFile>(std::move(file))) {}

  /// n x 3 doubles and m x 3 indices: views of the file's own.
  nb::object vertices() const;
  nb::object faces() const;
  bool splits_vertices() const { return file_->splits_vertices(); }
  /// A dictionary from names to vertices.
  nb::object groups() const;
  /// Tuples (node, mesh, first, count).
  nb::object parts() const;
  nb::object notices() const;
  /// As write_any_mesh(). `positions`: as many as vertices.
  void write(const std::string& path, const Numbers3& positions, bool adds_normals,
             std::optional<double> weld) const;

 private:
  std::shared_ptr<const AnyMeshFile> file_;
};

std::unique_ptr<LocalMeshFile> read_mesh_file(const std::string& path);

/// A file with this mesh and nothing else.
void write_mesh_file(const std::string& path, const Numbers3& vertices, const Indices3& faces);

}  // namespace lpdeform::python
