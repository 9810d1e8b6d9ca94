#pragma once

#include <string>

#include "client/cli/reproduce/figure.h"

namespace lpdeform::reproduce {

/// All results of an experiment have the same camera, so that they can be compared.

/// The undeformed shape; handles are blue, as in the paper.
Picture rest_picture(const Experiment& experiment);

/// The shape solved for p, coloured by distortion from 0 (blue) to its own largest (red).
Picture solved_picture(const Experiment& experiment, double p);

/// The undeformed shape with the region of p = 2 in orange.
Picture region_picture(const Experiment& experiment, const Mixed& mixed);
Picture mixed_picture(const Experiment& experiment, const Mixed& mixed);

}  // namespace lpdeform::reproduce
