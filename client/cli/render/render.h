#pragma once

#include <filesystem>

#include "absl/status/status.h"
#include "client/cli/render/image.h"
#include "core/base/geometry.h"

namespace lpdeform {

/// The picture of a mesh: smoothly shaded, light from the viewer's upper left, on a light background, seen as
/// Camera chooses. `distortion` has one finite value >= 0 a vertex and colours it as distortion_colours does,
/// with a legend; where it is empty the mesh is plain. Faces with an index outside `positions` or with a
/// coordinate that is not finite are left out. Width and height are in pixels, 1 to 16384 each.
Image render(const Faces& faces, const Points& positions, const Field& distortion, int width, int height);

/// The same as a PNG file, written whole or not at all. INVALID_ARGUMENT (IMAGE_SIZE) where width or height
/// is out of range; FILE_NOT_WRITTEN.
absl::Status render_png(const std::filesystem::path& path, const Faces& faces, const Points& positions,
                        const Field& distortion, int width = 1200, int height = 900);

}  // namespace lpdeform
