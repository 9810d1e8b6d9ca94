#pragma once

#include <filesystem>
#include <vector>

#include "absl/status/status.h"
#include "client/cli/render/image.h"
#include "core/base/colour.h"
#include "core/base/geometry.h"

namespace lpdeform {

/// How a mesh is drawn.
struct PictureStyle {
  /// In pixels, 1 to 16384 each.
  int width = 1200, height = 900;
  /// One finite value >= 0 a vertex, coloured blue to red; or empty.
  Field distortion;
  bool has_legend = true;  // where there is distortion
  /// The distortion shown in full red; 0 takes distortion_of_red.
  double red = 0;
  /// Where there is no distortion: a colour a vertex; or empty, then the mesh is plain.
  std::vector<Rgb> colours;
  /// Points that fit into the picture, so that pictures of one shape in several poses are seen alike; empty
  /// takes the mesh.
  Points frame;
};

/// The picture of a mesh: smoothly shaded, light from the viewer's upper left, on a light background, seen as
/// Camera chooses. Faces with an index outside `positions` or with a coordinate that is not finite are left
/// out.
Image render(const Faces& faces, const Points& positions, const PictureStyle& style);

/// The same with a distortion, which may be empty, and the rest as PictureStyle has it.
Image render(const Faces& faces, const Points& positions, const Field& distortion, int width, int height);

/// The same as a PNG file, written whole or not at all. INVALID_ARGUMENT (IMAGE_SIZE) where width or height
/// is out of range; FILE_NOT_WRITTEN.
absl::Status render_png(const std::filesystem::path& path, const Faces& faces, const Points& positions,
                        const PictureStyle& style);
absl::Status render_png(const std::filesystem::path& path, const Faces& faces, const Points& positions,
                        const Field& distortion, int width = 1200, int height = 900);

}  // namespace lpdeform
