#pragma once

#include <memory>
#include <vector>

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// What rays that are cast inwards from a component's faces meet.
struct Enclosure {
  double thickness = 0;  // the median over the component's area; infinite if most rays meet no other side
  double share = 0;      // the share of the area whose rays meet another side

  /// Details shorter than this count as noise: 0.15 of the thickness; 0 if the thickness is infinite.
  double noise_length() const;
};

/// One Enclosure per component. `thickness`: one value per face, from thickness_behind_faces().
std::vector<Enclosure> enclosures(const RestShape& shape, const std::vector<double>& thickness);

/// The shape without details that are small compared with its thickness, above all noise: its positions are smoothed by
/// S_r (SurfaceSmoother) with r = noise_length(). A component whose r is 0 stays as it is. The result has scaled units
/// of its own. Null if the factorisation fails, or if RestShape::create refuses the smoothed mesh (for example because
/// it has no area left).
std::shared_ptr<const RestShape> without_noise(const RestShape& shape,
                                               const std::vector<Enclosure>& components);

}  // namespace lpdeform
