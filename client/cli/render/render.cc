#include "client/cli/render/render.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/render/camera.h"
#include "client/cli/render/legend.h"
#include "client/cli/render/openness.h"
#include "client/cli/render/scene.h"
#include "client/cli/render/shading.h"
#include "core/base/check.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/base/workers.h"
#include "core/io/whole_file.h"

namespace lpdeform {
namespace {

constexpr int kLargestSide = 16384;

/// Samples along each side of a pixel: 3, or fewer if that would take too much memory.
int samples_per_side(std::int64_t width, std::int64_t height) {
  constexpr std::int64_t kMostSamples = 16'000'000;
  int side = 3;
  while (side > 1 && side * side * width * height > kMostSamples) --side;
  return side;
}

Faces drawable(const Faces& faces, const Points& positions) {
  std::vector<Eigen::Index> kept;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    bool is_drawable = true;
    for (const std::int32_t v : faces.row(f)) {
      is_drawable = is_drawable && v >= 0 && v < positions.rows() && positions.row(v).allFinite();
    }
    if (is_drawable) kept.push_back(f);
  }
  return rows_of(faces, kept);
}

/// The vertices that faces use; other vertices may have any coordinates.
Points used(const Faces& faces, const Points& positions) {
  Points result(faces.size(), 3);
  for (Eigen::Index k = 0; k < faces.size(); ++k) result.row(k) = positions.row(faces.reshaped()[k]);
  return result;
}

/// Moves and scales positions so that `frame` lies within [-1, 1]. Squares of lengths then stay in range.
struct ToUnitSize {
  explicit ToUnitSize(const Points& frame) {
    const Eigen::RowVector3d low = frame.colwise().minCoeff(), high = frame.colwise().maxCoeff();
    centre = high / 2 + low / 2;
    const double half = (high / 2 - low / 2).maxCoeff();
    half_size = half > 0 ? half : 1;
  }
  Points operator()(const Points& points) const { return (points.rowwise() - centre) / half_size; }

  Eigen::RowVector3d centre;
  double half_size;
};

/// The colour of a pixel of side x side samples. Within one face the colour hardly changes, so one sample is
/// enough; at edges all samples are used.
Rgb mean_colour(const Scene& scene, const Openness& openness_at, int x, int y, int side) {
  const int middle_x = side * x + side / 2, middle_y = side * y + side / 2;
  const double openness = openness_at.at(x, y);
  if (scene.is_one_face(side * x, side * y, side)) return scene.colour_at(middle_x, middle_y, openness);
  std::array<int, 3> sum{};
  for (int k = 0; k < side * side; ++k) {
    const Rgb colour = scene.colour_at(side * x + k % side, side * y + k / side, openness);
    for (int channel = 0; channel < 3; ++channel) sum[channel] += colour[channel];
  }
  const int count = side * side;
  Rgb mean;
  for (int channel = 0; channel < 3; ++channel) {
    mean[channel] = static_cast<std::uint8_t>((sum[channel] + count / 2) / count);
  }
  return mean;
}

double red_of(const PictureStyle& style) {
  return style.red > 0 ? style.red : distortion_of_red(style.distortion);
}

/// Values from 0 (blue) to 1 (red).
Field heat_of(const Field& distortion, double red) {
  if (!(red > 0)) return Field::Zero(distortion.size());
  return (distortion / red).cwiseMin(1);
}

Image empty_picture(int width, int height) {
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.set(x, y, background((y + 0.5) / height));
  }
  return image;
}

}  // namespace

Image render(const Faces& faces, const Points& positions, const PictureStyle& style) {
  const int width = style.width, height = style.height;
  LPDEFORM_CHECK(width >= 1 && width <= kLargestSide && height >= 1 && height <= kLargestSide);
  LPDEFORM_CHECK(style.distortion.size() == 0 || style.distortion.size() == positions.rows());
  LPDEFORM_CHECK(style.colours.empty() || std::ssize(style.colours) == positions.rows());
  const Faces kept = drawable(faces, positions);
  if (kept.rows() == 0) return empty_picture(width, height);
  const int side = samples_per_side(width, height);
  const Points frame = style.frame.rows() > 0 ? style.frame : used(kept, positions);
  const ToUnitSize to_unit_size(frame);
  const Scene scene({kept, to_unit_size(positions), heat_of(style.distortion, red_of(style)), style.colours},
                    Camera(to_unit_size(frame), side * width, side * height), side * width, side * height);
  Image image(width, height);
  const auto rows = static_cast<std::size_t>(height);
  const Workers workers(available_cores());
  const Openness openness(scene, side, workers);
  workers.for_chunks(rows, 16, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (int y = static_cast<int>(begin); y < static_cast<int>(end); ++y) {
      for (int x = 0; x < width; ++x) image.set(x, y, mean_colour(scene, openness, x, y, side));
    }
  });
  if (style.has_legend && style.distortion.size() > 0) draw_legend(image, red_of(style));
  return image;
}

Image render(const Faces& faces, const Points& positions, const Field& distortion, int width, int height) {
  PictureStyle style;
  style.width = width;
  style.height = height;
  style.distortion = distortion;
  return render(faces, positions, style);
}

absl::Status render_png(const std::filesystem::path& path, const Faces& faces, const Points& positions,
                        const PictureStyle& style) {
  const int width = style.width, height = style.height;
  if (width < 1 || width > kLargestSide || height < 1 || height > kLargestSide) {
    return make_fault({Reason::kImageSize, "", absl::StrCat("1 <= width, height <= ", kLargestSide)},
                      absl::StrCat("A picture of ", width, " x ", height,
                                   " pixels is out of range: each side is 1 to ", kLargestSide, "."));
  }
  return write_whole_file(path, png_bytes(render(faces, positions, style)));
}

absl::Status render_png(const std::filesystem::path& path, const Faces& faces, const Points& positions,
                        const Field& distortion, int width, int height) {
  PictureStyle style;
  style.width = width;
  style.height = height;
  style.distortion = distortion;
  return render_png(path, faces, positions, style);
}

}  // namespace lpdeform
