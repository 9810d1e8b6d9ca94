#pragma once

#include <vector>

#include "core/analysis/shape_features.h"
#include "core/energy/rest_shape.h"
#include "core/resize/scaling.h"

namespace lpdeform {

/// To what extent the resizing of each component spares its salient parts, 0 to 1. At 0 it is scaled by
/// the three factors, without sparing:
///
///   sparing = share(ramp(salience_i; 0.4, 0.5)) share(ramp(d_i; 0.1, 0.25))
///   ramp(x; a, b) = 0 for x <= a, 1 for x >= b, smooth in between
///   share(c)      = min(1, (mean of c_i over the component's area) / 0.01)
///
/// salience_i is that of core/analysis/salience.h for the axes of the scaling, weighted by |log scale_k| / max_j |log
/// scale_j|. d_i is the distance from the best-fitting ellipsoid (core/analysis/ellipsoid.h). Both factors are needed.
/// A component that does not bend along the axes has nothing to spare, such as a tube along its length. A ball or an
/// ellipsoid bends everywhere, even more on a coarse mesh or with noise, but no part of it stands out.
///
/// Compute this on the original shape, once for each axis, not on a shape that is already stretched. Otherwise the
/// stretch along one axis would influence the sparing for the next.
std::vector<double> sparing(const ShapeFeatures& features, const Scaling& scaling);

/// (1 - sparing) plain_i + sparing spared_i with the sparing of the vertex's component. Vertices that no face uses get
/// plain_i.
Points blended(const RestShape& shape, const std::vector<double>& sparing, const Points& plain,
               const Points& spared);

}  // namespace lpdeform
