#pragma once

#include <filesystem>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/gltf/gltf.h"
#include "core/io/mesh_io.h"

namespace lpdeform {

/// A mesh from a file of any format that is read, and what an output in the same format keeps.
struct AnyMeshFile : MeshFile {
  std::optional<gltf::Gltf> gltf;  // if it is a GLB or glTF file

  /// Whether vertices are welded if nothing else was asked for: glTF splits them along seams.
  bool splits_vertices() const { return gltf.has_value(); }
};

/// Reads GLB, glTF, OFF, OBJ, PLY or STL, by the ending of `path`. Errors: those of read_mesh() and of Gltf::read().
absl::StatusOr<AnyMeshFile> read_any_mesh(const std::filesystem::path& path);

/// What a written file has beside the positions.
struct Beside {
  Field distortion = {};          // one per vertex, or empty; for PLY
  Points normals = Points(0, 3);  // one per vertex, or empty; for PLY
  /// GLB, glTF and OBJ: gets normals even if the input has none. Those that it has turn with the surface in any case.
  bool adds_normals = false;
  std::optional<double> weld = {};  // the tolerance if vertices are welded by position, for normals
};

/// Writes `positions`, one per vertex of the file's mesh, as GLB, glTF, OFF, OBJ or PLY, by the ending of `path`, completely or
/// not at all. GLB and glTF keep everything else of a glTF input, and OBJ of an OBJ input. Errors: MESH_FORMAT_UNKNOWN,
/// MESH_NOT_FINITE, FILE_NOT_WRITTEN, and those of Gltf::bytes(); those of deformable() for a new glTF and for normals of an OBJ
/// file.
absl::Status write_any_mesh(const std::filesystem::path& path, const AnyMeshFile& file,
                            const Points& positions, const Beside& beside);

}  // namespace lpdeform
