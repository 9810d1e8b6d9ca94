#include "client/cli/render/legend.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>
#include <string_view>

namespace lpdeform {
namespace {

constexpr Rgb kInk{70, 74, 80};
constexpr int kGlyphWidth = 5, kGlyphHeight = 7;

struct Glyph {
  char character;
  std::array<std::uint8_t, kGlyphHeight> rows;  // from the top; the highest of the 5 bits is the leftmost dot
};

constexpr std::array<Glyph, 14> kGlyphs{{
    {'0', {0x0E, 0x11, 0x13, 0x15, 0x19, 0x11, 0x0E}},
    {'1', {0x04, 0x0C, 0x04, 0x04, 0x04, 0x04, 0x0E}},
    {'2', {0x0E, 0x11, 0x01, 0x02, 0x04, 0x08, 0x1F}},
    {'3', {0x1F, 0x02, 0x04, 0x02, 0x01, 0x11, 0x0E}},
    {'4', {0x02, 0x06, 0x0A, 0x12, 0x1F, 0x02, 0x02}},
    {'5', {0x1F, 0x10, 0x1E, 0x01, 0x01, 0x11, 0x0E}},
    {'6', {0x06, 0x08, 0x10, 0x1E, 0x11, 0x11, 0x0E}},
    {'7', {0x1F, 0x01, 0x02, 0x04, 0x08, 0x08, 0x08}},
    {'8', {0x0E, 0x11, 0x11, 0x0E, 0x11, 0x11, 0x0E}},
    {'9', {0x0E, 0x11, 0x11, 0x0F, 0x01, 0x02, 0x0C}},
    {'.', {0x00, 0x00, 0x00, 0x00, 0x00, 0x0C, 0x0C}},
    {'-', {0x00, 0x00, 0x00, 0x1F, 0x00, 0x00, 0x00}},
    {'+', {0x00, 0x04, 0x04, 0x1F, 0x04, 0x04, 0x00}},
    {'e', {0x00, 0x00, 0x0E, 0x11, 0x1F, 0x10, 0x0E}},
}};

void fill(Image& image, int left, int top, int width, int height, Rgb colour) {
  for (int y = std::max(0, top); y < std::min(image.height, top + height); ++y) {
    for (int x = std::max(0, left); x < std::min(image.width, left + width); ++x) image.set(x, y, colour);
  }
}

int text_width(std::string_view text, int dot) {
  return static_cast<int>(text.size()) * (kGlyphWidth + 1) * dot;
}

void draw_text(Image& image, std::string_view text, int left, int top, int dot) {
  for (const char character : text) {
    const auto glyph = std::find_if(kGlyphs.begin(), kGlyphs.end(),
                                    [&](const Glyph& candidate) { return candidate.character == character; });
    for (int k = 0; glyph != kGlyphs.end() && k < kGlyphWidth * kGlyphHeight; ++k) {
      const int x = k % kGlyphWidth, y = k / kGlyphWidth;
      const bool is_ink = (glyph->rows[y] >> (kGlyphWidth - 1 - x) & 1) != 0;
      if (is_ink) fill(image, left + x * dot, top + y * dot, dot, dot, kInk);
    }
    left += (kGlyphWidth + 1) * dot;
  }
}

std::string three_digits(double number) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.3g", number);
  return text;
}

}  // namespace

void draw_legend(Image& image, double red) {
  const int dot = std::max(1, image.height / 450);
  const int bar_width = image.width / 5, bar_height = 6 * dot, edge = 12 * dot;
  const int left = image.width - edge - bar_width, top = image.height - edge - bar_height - 11 * dot;
  for (int x = 0; x < bar_width; ++x) {
    fill(image, left + x, top, 1, bar_height, blue_to_red((x + 0.5) / bar_width));
  }
  const std::string high = three_digits(red);
  const int text_top = top + bar_height + 4 * dot;
  draw_text(image, "0", left, text_top, dot);
  draw_text(image, high, image.width - edge - text_width(high, dot) + dot, text_top, dot);
}

}  // namespace lpdeform
