#pragma once

#include <optional>
#include <string>

#include "core/io/mesh_io.h"

namespace lpdeform {

/// The text of an OBJ file at `positions`, one per vertex of `file.mesh`, with normals that are ready to draw. It has
/// new vn lines: one normal for each pair of a vertex and a normal that occurs in an f line of the source, deformed by
/// CarriedNormals. Hard edges of the source, where a vertex occurs with several normals, therefore stay hard, and
/// corners that shared a normal still share one. Corners without a normal get the smooth one. Texture coordinates,
/// groups and materials stay; the source's own vn lines, which are out of date, are dropped. A source in another format
/// than OBJ gets smooth normals.
///
/// `weld`: the tolerance if vertices are welded by position, the same that the session uses; it must be one that
/// weld_by_position() accepts for this mesh. deformable() must accept the mesh of `file`.
std::string obj_text_with_normals(const MeshFile& file, const Points& positions, std::optional<double> weld);

/// Whether the source is an OBJ file with vn lines.
bool has_obj_normals(const MeshFile& file);

}  // namespace lpdeform
