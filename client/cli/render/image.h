#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/colour.h"

namespace lpdeform {

/// Pixels row by row from the top left.
struct Image {
  Image(int image_width, int image_height);

  void set(int x, int y, Rgb colour);

  int width, height;
  std::vector<std::uint8_t> bytes;  // red, green, blue
};

/// The image as a PNG file.
std::string png_bytes(const Image& image);

}  // namespace lpdeform
