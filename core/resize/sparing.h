#pragma once

#include <vector>

#include "core/analysis/shape_features.h"
#include "core/resize/resize.h"

namespace lpdeform {

/// How much of each component's resizing spares what is salient, 0 to 1; the rest is plain scaling:
///
///   sparing = share(ramp(salience_i; 0.4, 0.5)) share(ramp(d_i; 0.1, 0.25))
///   ramp(x; a, b) = 0 up to a, 1 from b, smooth in between
///   share(c)      = min(1, (mean of c_i over the component's area) / 0.01)
///
/// with the salience of core/analysis/salience.h for the axes of the scaling, weighted by |log scale_k| over the largest
/// of these, and the distance d from the nearest ellipsoid of core/analysis/ellipsoid.h. Both factors are needed. A
/// component that bends nowhere along the axes has nothing to be spared, such as a tube along its length. A ball or an
/// ellipsoid bends everywhere, and more on a coarse mesh or with noise, but no part of it stands out.
///
/// To be asked of the shape as it is given, once for each axis, and not of one that is stretched already: the next
/// axis would then be judged by what the one before has left.
std::vector<double> sparing(const ShapeFeatures& features, const Scaling& scaling);

/// (1 - sparing) plain_i + sparing spared_i, the sparing that of the vertex's component. Vertices that no face uses are
/// plain.
Points blended(const RestShape& shape, const std::vector<double>& sparing, const Points& plain,
               const Points& spared);

}  // namespace lpdeform
