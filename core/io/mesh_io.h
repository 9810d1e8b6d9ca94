#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/mesh/mesh.h"

namespace lpdeform {

/// ".obj" of "a/b.OBJ", in lower case. Empty if the name has no ending.
std::string ending_of(const std::filesystem::path& path);

enum class MeshFormat { kOff, kObj, kPly, kStl };

/// The format by the file name's extension, in upper or lower case. INVALID_ARGUMENT (MESH_FORMAT_UNKNOWN) names the
/// known extensions.
absl::StatusOr<MeshFormat> mesh_format(const std::filesystem::path& path);

/// A mesh, and the parts of its file that an output in the same format must keep.
struct MeshFile {
  TriangleMesh mesh;
  /// OBJ only: the input's text. write_obj puts new coordinates into its "v" lines and keeps every other line
  /// (texture coordinates, groups, materials, polygons) as it is. Empty for the other formats.
  std::string obj_source;
};

/// Reads OFF (also COFF, NOFF, STOFF), OBJ (negative indices too), PLY (ASCII, binary of either byte order), STL
/// (ASCII, binary). Polygons become fans of triangles around their first vertex; faces of fewer than three vertices are
/// left out. STL corners with equal coordinates (0 and -0 are equal) become one vertex, in order of first appearance.
/// In all other formats the vertex order is that of the file. Errors: NOT_FOUND (MESH_FILE_NOT_FOUND), INVALID_ARGUMENT
/// (MESH_FORMAT_UNKNOWN; MESH_SYNTAX with the line or byte, also for coordinates that are not finite and for corners whose
/// vertex is not there, with the vertex and the face as the file counts them). The mesh may have all other defects:
/// check_mesh reports them.
absl::StatusOr<MeshFile> read_mesh(const std::filesystem::path& path);

/// The same from memory.
absl::StatusOr<MeshFile> parse_mesh(std::string_view bytes, MeshFormat format);

/// Writes `positions` (one per vertex of `file.mesh`) with the faces of `file` as OFF, OBJ or PLY (binary, double
/// coordinates, little-endian), by the extension of `path`. If `distortion` has one value per vertex, a PLY file gets a
/// double property "distortion" and red, green, blue (uchar), from blue to red. If `normals` has one row per vertex, it
/// gets nx, ny, nz (float). Both may be empty. OBJ with normals: core/io/obj_normals.h. The file is written completely
/// or not at all (temporary file, then rename).
absl::Status write_mesh(const std::filesystem::path& path, const MeshFile& file, const Points& positions,
                        const Field& distortion, const Points& normals = Points(0, 3));

/// The text of an OBJ file. Coordinates are the shortest text that reads back to the same double.
std::string obj_text(const MeshFile& file, const Points& positions);

}  // namespace lpdeform
