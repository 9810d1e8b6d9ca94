#pragma once

#include <vector>

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// rho of each connected component, in scaled units: the distance at which its geometry is measured. It is 4 % of the
/// square root of the component's area (which rotations do not change), but at least its mean edge length. > 0.
std::vector<double> component_lengths(const RestShape& shape);

}  // namespace lpdeform
