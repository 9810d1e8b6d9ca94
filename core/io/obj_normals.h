#pragma once

#include <optional>
#include <string>

#include "core/io/mesh_io.h"

namespace lpdeform {

/// The text of an OBJ file at `positions`, one a vertex of `file.mesh`, with normals that are ready to draw: vn
/// lines of its own, a normal for each pair of a vertex and a normal that stand together in an f line of the
/// source, carried along as CarriedNormals has it. So the source's hard edges, where a vertex stands with
/// several normals, stay hard, and what shared a normal goes on sharing one. Corners without a normal get the
/// smooth one. Texture coordinates, groups and materials stay; the source's own vn lines, which are out of
/// date, go. A source of another format than OBJ gets smooth normals.
///
/// `weld`: the tolerance where vertices are welded by position, as in a session that does so and that took it.
/// `file` is one that deformable() accepts.
std::string obj_text_with_normals(const MeshFile& file, const Points& positions, std::optional<double> weld);

/// The source is an OBJ with vn lines.
bool has_obj_normals(const MeshFile& file);

}  // namespace lpdeform
