#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/geometry.h"

namespace lpdeform {

using Rgb = std::array<std::uint8_t, 3>;

/// Blue (0) over cyan, green and yellow to red (1), as in the paper's figures. `t` is clamped to [0, 1].
Rgb blue_to_red(double t);

/// Colours of a distortion field: linear from 0 to its 95th percentile, so that one outlier does not turn the rest blue.
/// A field of zeros is blue throughout.
std::vector<Rgb> distortion_colours(const Field& distortion);

}  // namespace lpdeform
