#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/library/result.h"
#include "core/library/types.h"

namespace lpdeform::core {

/// The vertices of all triangles that go by one name.
struct MeshGroup {
  std::string name = {};
  std::vector<std::uint32_t> vertices = {};  // ascending
};

/// The vertices that one node of a glTF file draws. Names are empty if the file has none.
struct MeshPart {
  std::string node = {}, mesh = {};
  std::size_t first = 0, count = 0;
};

/// How MeshFile::write() makes normals.
struct WriteOptions {
  /// GLB, glTF and OBJ: gets normals even if the file has none. Those that it has turn with the surface in any case.
  bool adds_normals = false;
  /// Vertices within this share of the bounding box's diagonal count as one, 0 to 1e-3; 0 is 1e-6. Left out: 0 for a glTF
  /// file, whose format splits vertices along seams, and otherwise none do.
  std::optional<double> weld = {};
};

/// A mesh file: the mesh in it, and everything else that it holds, which stays when it is written. Immutable; a copy costs
/// little.
///
/// GLB and glTF 2.0: the mesh is what the scene draws as triangles, each node where it stands. What is written has new
/// positions, and normals and tangents that are turned as the surface turns. Texture coordinates, materials, images, weights of
/// skins, morph targets, animations, names, extras and extensions come back to the bit.
/// OBJ: the positions and normals change, and every other line stays.
class MeshFile {
 public:
  /// Reads GLB, glTF, OFF, OBJ, PLY or STL, by the ending of `path`. Polygons become triangles. Errors: MESH_FILE_NOT_FOUND,
  /// MESH_FORMAT_UNKNOWN, MESH_SYNTAX and MESH_UNSUPPORTED, which name the line, the byte or the part, such as `accessor 3`.
  static Result<MeshFile> read(const std::string& path);

  const Mesh& mesh() const;
  /// Whether its format splits vertices along seams, as glTF does. Such a mesh must be welded before it is deformed: weld().
  bool splits_vertices() const;
  /// By nodes, meshes and materials of a glTF file. Other formats have none.
  std::vector<MeshGroup> groups() const;
  std::vector<MeshPart> parts() const;
  /// What is drawn and yet stays as it is, such as lines, one sentence each.
  std::vector<std::string> notices() const;

  /// Writes GLB, glTF, OFF, OBJ or PLY, by the ending of `path`, completely or not at all. `positions`: 3 numbers for each vertex
  /// of mesh(). What the file holds beside its mesh is kept if both are glTF (.glb or .gltf), or both OBJ. Errors:
  /// POSITIONS_SIZE, MESH_FORMAT_UNKNOWN, MESH_NOT_FINITE, FILE_NOT_WRITTEN. GLB and glTF: MESH_UNSUPPORTED (a position beyond the
  /// range of float32, in which glTF has numbers, or a file that would be too large) and MESH_SYNTAX (a part that is wrong, or an
  /// image whose file has gone since). A new GLB or glTF, and normals of an OBJ: MESH_EMPTY, MESH_INDEX_OUT_OF_RANGE, MESH_NO_AREA.
  /// Normals: WELD_TOLERANCE, WELD_TOO_DENSE.
  Result<void> write(const std::string& path, const std::vector<double>& positions,
                     const WriteOptions& options = {}) const;

 private:
  struct Contents;
  explicit MeshFile(std::shared_ptr<const Contents> contents) : contents_(std::move(contents)) {}
  std::shared_ptr<const Contents> contents_;
};

}  // namespace lpdeform::core
