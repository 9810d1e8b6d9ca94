#pragma once

#include <optional>

#include "core/gltf/draw_list.h"

namespace lpdeform::gltf {

/// The document with what its blocks draw at `positions` (one per vertex of the list's mesh), with normals and tangents turned
/// as the surface turns. Values lie where they lay, if nothing else uses those bytes, and otherwise in accessors that are added;
/// meshes that several nodes draw are parted. Everything else stays as it is, and so does every value that has not changed.
/// `weld`: the tolerance if vertices are welded by position. `adds_normals`: also where
/// there are none. Throws a Refusal if a position is beyond the range of float32, and the errors of weld_by_position().
Document rewritten(const Document& document, const DrawList& list, const Points& positions,
                   std::optional<double> weld, bool adds_normals);

}  // namespace lpdeform::gltf
