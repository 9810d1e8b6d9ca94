#include "client/cli/render/render.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/render/camera.h"
#include "client/cli/render/corner_normals.h"
#include "client/cli/render/legend.h"
#include "client/cli/render/raster.h"
#include "client/cli/render/shading.h"
#include "core/base/check.h"
#include "core/base/fault.h"
#include "core/mesh/whole_file.h"

namespace lpdeform {
namespace {

constexpr int kLargestSide = 16384;
constexpr Rgb kPlain{196, 190, 180};

/// Samples along each side of a pixel: 3, or fewer where that would be more samples than memory is to hold.
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
  return faces(kept, Eigen::all);
}

Points corners_of(const Faces& faces, const Points& positions) {
  Points corners(3 * faces.rows(), 3);
  for (Eigen::Index corner = 0; corner < corners.rows(); ++corner) {
    corners.row(corner) = positions.row(faces(corner / 3, corner % 3));
  }
  return corners;
}

/// Everything that the colour of a sample depends on.
class Scene {
 public:
  Scene(const Faces& faces, const Points& positions, const Field& distortion, int width, int height)
      : faces_(faces),
        corners_(corners_of(faces, positions)),
        normals_(corner_normals(positions, faces)),
        camera_(corners_, width, height),
        raster_(width, height) {
    const double red = distortion.size() > 0 ? distortion_of_red(distortion) : 0;
    heat_ = red > 0 ? (distortion / red).cwiseMin(1).eval() : Field::Zero(distortion.size()).eval();
    Points projected(corners_.rows(), 3);
    for (Eigen::Index corner = 0; corner < corners_.rows(); ++corner) {
      projected.row(corner) = camera_.project(corners_.row(corner));
    }
    for (Eigen::Index f = 0; f < faces.rows(); ++f) {
      raster_.draw(static_cast<std::int32_t>(f),
                   {projected.row(3 * f), projected.row(3 * f + 1), projected.row(3 * f + 2)});
    }
  }

  Rgb colour_at(int x, int y) const {
    const Raster::Sample& sample = raster_.at(x, y);
    if (sample.face < 0) return background((y + 0.5) / raster_.height());
    const Eigen::RowVector3d point = inside(corners_, sample);
    const Eigen::RowVector3d normal = camera_.turn(inside(normals_, sample)).normalized();
    return shaded(albedo(sample), normal, camera_.towards_camera(point), 1);
  }

 private:
  static Eigen::RowVector3d inside(const Points& corner_values, const Raster::Sample& sample) {
    const Eigen::Index first = 3 * Eigen::Index{sample.face};
    return (1 - sample.b - sample.c) * corner_values.row(first) + sample.b * corner_values.row(first + 1) +
           sample.c * corner_values.row(first + 2);
  }

  Rgb albedo(const Raster::Sample& sample) const {
    if (heat_.size() == 0) return kPlain;
    const auto face = faces_.row(sample.face);
    return blue_to_red((1 - sample.b - sample.c) * heat_[face[0]] + sample.b * heat_[face[1]] +
                       sample.c * heat_[face[2]]);
  }

  const Faces& faces_;
  Points corners_, normals_;  // 3 f + k for corner k of face f
  Camera camera_;
  Raster raster_;
  Field heat_;  // 0 to 1 a vertex; empty: plain
};

Rgb mean_colour(const Scene& scene, int x, int y, int side) {
  std::array<int, 3> sum{};
  for (int k = 0; k < side * side; ++k) {
    const Rgb colour = scene.colour_at(side * x + k % side, side * y + k / side);
    for (int channel = 0; channel < 3; ++channel) sum[channel] += colour[channel];
  }
  const int count = side * side;
  Rgb mean;
  for (int channel = 0; channel < 3; ++channel) {
    mean[channel] = static_cast<std::uint8_t>((sum[channel] + count / 2) / count);
  }
  return mean;
}

Image empty_picture(int width, int height) {
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.set(x, y, background((y + 0.5) / height));
  }
  return image;
}

}  // namespace

Image render(const Faces& faces, const Points& positions, const Field& distortion, int width, int height) {
  LPDEFORM_CHECK(width >= 1 && width <= kLargestSide && height >= 1 && height <= kLargestSide);
  LPDEFORM_CHECK(distortion.size() == 0 || distortion.size() == positions.rows());
  const Faces kept = drawable(faces, positions);
  if (kept.rows() == 0) return empty_picture(width, height);
  const int side = samples_per_side(width, height);
  const Scene scene(kept, positions, distortion, side * width, side * height);
  Image image(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) image.set(x, y, mean_colour(scene, x, y, side));
  }
  if (distortion.size() > 0) draw_legend(image, distortion_of_red(distortion));
  return image;
}

absl::Status render_png(const std::filesystem::path& path, const Faces& faces, const Points& positions,
                        const Field& distortion, int width, int height) {
  if (width < 1 || width > kLargestSide || height < 1 || height > kLargestSide) {
    return invalid_input({"IMAGE_SIZE", "", absl::StrCat("1 <= width, height <= ", kLargestSide)},
                         absl::StrCat("A picture of ", width, " x ", height,
                                      " pixels is out of range: each side is 1 to ", kLargestSide, "."));
  }
  return write_whole_file(path, png_bytes(render(faces, positions, distortion, width, height)));
}

}  // namespace lpdeform
