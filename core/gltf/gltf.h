#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/mesh/mesh.h"

namespace lpdeform::gltf {

enum class Packing { kGlb, kGltf };

/// By the ending: .glb, .gltf, or neither.
std::optional<Packing> packing_of(const std::filesystem::path& path);

/// Vertices that one node draws. Names are empty if the file has none.
struct Part {
  std::string node, mesh;
  Eigen::Index first = 0, count = 0;
};

/// The vertices of the triangles of all nodes, meshes and materials of this name, ascending.
struct NamedVertices {
  std::string name;
  std::vector<std::uint32_t> vertices;
};

/// A GLB or glTF 2.0 file as one mesh, and the file itself, so that it can be written with the mesh deformed.
///
/// The mesh is what the file's scene draws as triangles, where it is drawn. Nodes come in the order of the scene, each before
/// its children, their primitives in the order of the file, and vertices in the order of their accessor; primitives of a node
/// that share accessors share vertices. A mesh that several nodes draw is there several times. Morph targets and animations
/// are not applied; a mesh with a skin stands as it was bound. Triangles of a mirrored node are turned, so that they all
/// face outwards. Immutable.
class Gltf {
 public:
  /// Errors: MESH_FILE_NOT_FOUND; MESH_SYNTAX and MESH_UNSUPPORTED name the part of the file, such as `accessor 3`.
  static absl::StatusOr<Gltf> read(const std::filesystem::path& path);

  /// `folder`: where files that it names lie. A file outside of it is not read.
  static absl::StatusOr<Gltf> parse(std::string_view bytes, const std::filesystem::path& folder);

  /// A file with this mesh and nothing else. At least one vertex and face, indices in range.
  static absl::StatusOr<Gltf> of_mesh(const TriangleMesh& mesh);

  const TriangleMesh& mesh() const;
  std::vector<Part> parts() const;
  std::vector<NamedVertices> groups() const;

  /// What stays as it is although it is drawn, one sentence each.
  const std::vector<std::string>& notices() const;

  /// The file with `positions`, one per vertex of the mesh, and with normals and tangents turned as the surface turns. All else
  /// is as it came, to the bit: texture coordinates, weights of skins, morph targets, images, materials, animations, extras and
  /// extensions. Numbers are float32. Buffers, and images in the file's folder, are put in. `weld`: the tolerance if vertices
  /// are welded by position. `adds_normals`: also where the file has none. Errors:
  /// MESH_UNSUPPORTED if a position is beyond the range of float32, or the result too large; MESH_SYNTAX if an image's file has
  /// gone since the glTF was read; those of weld_by_position().
  absl::StatusOr<std::string> bytes(const Points& positions, Packing packing, std::optional<double> weld,
                                    bool adds_normals = false) const;

 private:
  struct Contents;
  explicit Gltf(std::shared_ptr<const Contents> contents) : contents_(std::move(contents)) {}

  std::shared_ptr<const Contents> contents_;
};

}  // namespace lpdeform::gltf
