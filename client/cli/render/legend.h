#pragma once

#include "client/cli/render/image.h"

namespace lpdeform {

/// Draws a bar of the colours from blue to red into the lower right corner, with 0 at one end and `red` at
/// the other. Parts outside the image are not drawn.
void draw_legend(Image& image, double red);

}  // namespace lpdeform
