#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/base/fault.h"
#include "core/io/mesh_io.h"

namespace lpdeform {

/// A mesh from rows of coordinates and of indices.
inline TriangleMesh make_mesh(const std::vector<std::array<double, 3>>& vertices,
                              const std::vector<std::array<std::int32_t, 3>>& faces) {
  TriangleMesh mesh;
  mesh.vertices.resize(static_cast<Eigen::Index>(vertices.size()), 3);
  mesh.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t v = 0; v < vertices.size(); ++v)
    mesh.vertices.row(v) << vertices[v][0], vertices[v][1], vertices[v][2];
  for (std::size_t f = 0; f < faces.size(); ++f) mesh.faces.row(f) << faces[f][0], faces[f][1], faces[f][2];
  return mesh;
}

/// Equal to the last bit, so that NaN equals itself and 0 does not equal -0.
inline bool same_bits(const Points& a, const Points& b) {
  return a.rows() == b.rows() && std::memcmp(a.data(), b.data(), sizeof(double) * a.size()) == 0;
}

inline bool same_faces(const Faces& a, const Faces& b) {
  return a.rows() == b.rows() && a == b;
}

/// The mesh that `text` describes; fails the test if it is not accepted.
inline TriangleMesh parsed(std::string_view text, MeshFormat format) {
  const absl::StatusOr<MeshFile> file = parse_mesh(text, format);
  EXPECT_TRUE(file.ok()) << file.status();
  return file.ok() ? file->mesh : TriangleMesh{};
}

/// Where `text` is refused with MESH_SYNTAX ("line 3"); otherwise "accepted" or the other reason.
inline std::string refused_at(std::string_view text, MeshFormat format) {
  const absl::StatusOr<MeshFile> file = parse_mesh(text, format);
  if (file.ok()) return "accepted";
  EXPECT_EQ(file.status().code(), absl::StatusCode::kInvalidArgument);
  const Fault fault = fault_of(file.status());
  return fault.reason == "MESH_SYNTAX" ? fault.element : fault.reason;
}

/// The sentence with which `text` is refused.
inline std::string refusal_of(std::string_view text, MeshFormat format) {
  return std::string(parse_mesh(text, format).status().message());
}

/// An empty folder for one test, removed afterwards.
class ScratchFolder {
 public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "lpdeform-mesh-XXXXXX").string();
    path_ = mkdtemp(name.data());
  }
  ~ScratchFolder() { std::filesystem::remove_all(path_); }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

inline void put_file(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

}  // namespace lpdeform
