#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/base/geometry.h"
#include "core/mesh/mesh.h"

namespace lpdeform::reproduce {

/// How elongated an ellipse a circle has become, >= 1: the ratio of the singular values of the affine map of
/// a plane that best takes the rest positions of `rim` to the deformed ones (least squares). The plane is the
/// one in which the rest positions extend most. So any sampling of any curve gives 1 if the deformation
/// moves, rotates or uniformly scales it. At least 3 vertices that are not on one line; infinity if all
/// deformed ones are.
double axis_ratio(const Points& rest, const Points& deformed, std::span<const std::int32_t> rim);

/// Root-mean-square of |deformed - rest| over the vertices that are farther than `distance` at rest from
/// every vertex of `from`; 0 if there is none. In the mesh's unit.
double displacement_far_from(const Points& rest, const Points& deformed, std::span<const std::int32_t> from,
                             double distance);

/// The share of `values` that are at most `limit`; 0 if there are none.
double share_up_to(const Field& values, double limit);

/// The share of the sum of `values` that their largest twentieth (rounded up) holds, as in
/// DistortionStatistics.
double top_share(const Field& values);

/// Counts of values in `bins` equal parts of [0, highest], each closed below. Values above `highest` > 0
/// count in the last bin.
std::vector<std::int64_t> histogram(const Field& values, double highest, int bins);

/// The `values` at `indices`, in the order of the indices.
Field at(const Field& values, std::span<const std::int32_t> indices);

/// Length of the diagonal of the bounding box.
double diagonal(const Points& points);

}  // namespace lpdeform::reproduce
