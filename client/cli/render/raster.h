#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "core/base/geometry.h"

namespace lpdeform {

/// The nearest surface at each sample of a picture: the face, and where inside it.
class Raster {
 public:
  struct Sample {
    std::int32_t face = -1;  // -1: background
    float inverse_depth = 0;
    float b = 0, c = 0;  // weights of the second and third corner; the first has the rest
  };

  Raster(int width, int height) : width_(width), height_(height), samples_(std::size_t(width) * height) {}

  int width() const { return width_; }
  int height() const { return height_; }
  const Sample& at(int x, int y) const { return samples_[std::size_t(y) * width_ + x]; }

  /// Draws a triangle with corners (x, y, inverse depth); a larger inverse depth hides a smaller one. The
  /// orientation does not matter.
  void draw(std::int32_t face, const std::array<Eigen::RowVector3d, 3>& corners);

 private:
  int width_, height_;
  std::vector<Sample> samples_;
};

}  // namespace lpdeform
