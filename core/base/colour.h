#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/geometry.h"

namespace lpdeform {

using Rgb = std::array<std::uint8_t, 3>;

/// Blue (0) over cyan, green and yellow to red (1), as in the paper's figures. `t` is clamped to [0, 1].
Rgb blue_to_red(double t);

/// The distortion that is shown in full red: the 95th percentile, so that one outlier does not turn the rest
/// blue; the maximum where that percentile is 0; 0 where all is 0. All values must be finite and >= 0.
double distortion_of_red(const Field& distortion);

/// Colours of a distortion field, linear from 0 (blue) to distortion_of_red. A field of zeros is blue
/// throughout.
std::vector<Rgb> distortion_colours(const Field& distortion);

}  // namespace lpdeform
