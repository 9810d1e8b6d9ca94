#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/geometry.h"

namespace lpdeform {

using Rgb = std::array<std::uint8_t, 3>;

/// From blue (0) through cyan, green and yellow to red (1), as in the paper's figures. `t` is clamped to [0, 1].
Rgb blue_to_red(double t);

/// The distortion that is shown in full red: the 95th percentile, so that one outlier does not turn the rest blue. If
/// that percentile is 0, the maximum; 0 if all values are 0. All values must be finite and >= 0.
double distortion_of_red(const Field& distortion);

/// Colours of a distortion field, linear from 0 (blue) to distortion_of_red (red). A field of zeros is blue everywhere.
std::vector<Rgb> distortion_colours(const Field& distortion);

}  // namespace lpdeform
