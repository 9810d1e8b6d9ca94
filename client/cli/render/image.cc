#include "client/cli/render/image.h"

#include <png.h>

#include <algorithm>

#include "core/base/check.h"

namespace lpdeform {

Image::Image(int image_width, int image_height)
    : width(image_width),
      height(image_height),
      bytes(3 * static_cast<std::size_t>(image_width) * image_height) {}

void Image::set(int x, int y, Rgb colour) {
  std::copy(colour.begin(), colour.end(), bytes.begin() + 3 * (static_cast<std::ptrdiff_t>(y) * width + x));
}

std::string png_bytes(const Image& image) {
  png_image head{};
  head.version = PNG_IMAGE_VERSION;
  head.width = static_cast<png_uint_32>(image.width);
  head.height = static_cast<png_uint_32>(image.height);
  head.format = PNG_FORMAT_RGB;
  std::string png(PNG_IMAGE_PNG_SIZE_MAX(head), '\0');
  png_alloc_size_t size = png.size();
  LPDEFORM_CHECK(png_image_write_to_memory(&head, png.data(), &size, 0, image.bytes.data(), 0, nullptr) != 0);
  png.resize(size);
  return png;
}

}  // namespace lpdeform
