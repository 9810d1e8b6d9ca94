#pragma once

#include <vector>

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// rho of each connected component, in scaled units: the distance at which its geometry is measured, 4 % of
/// the square root of its area (which does not change where it is turned), and at least its mean edge. > 0.
std::vector<double> component_lengths(const RestShape& shape);

}  // namespace lpdeform
