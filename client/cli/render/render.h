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
  /// One finite value >= 0 per vertex, coloured blue to red; or empty.
  Field distortion;
  bool has_legend = true;  // drawn only with distortion
  /// The distortion shown in full red; 0 uses distortion_of_red.
  double red = 0;
  /// Used if there is no distortion: one colour per vertex; if empty, the mesh is plain.
  std::vector<Rgb> colours;
  /// Points that must fit into the picture, so that pictures of one shape in several poses have the same
  /// view; if empty, the mesh.
  Points frame;
};

/// Draws a mesh with smooth shading, light from the viewer's upper left, and a light background, as Camera
/// sees it. Faces with an index outside `positions`, or with a coordinate that is not finite, are omitted.
Image render(const Faces& faces, const Points& positions, const PictureStyle& style);

/// The same with a distortion, which may be empty, and defaults for the rest of PictureStyle.
Image render(const Faces& faces, const Points& positions, const Field& distortion, int width, int height);

/// The same as a PNG file, written completely or not at all. INVALID_ARGUMENT (IMAGE_SIZE) if width or height
/// is out of range; FILE_NOT_WRITTEN.
absl::Status render_png(const std::filesystem::path& path, const Faces& faces, const Points& positions,
                        const PictureStyle& style);
absl::Status render_png(const std::filesystem::path& path, const Faces& faces, const Points& positions,
                        const Field& distortion, int width = 1200, int height = 900);

}  // namespace lpdeform
