#pragma once

#include <memory>
#include <vector>

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// What rays inwards from a component's faces meet.
struct Enclosure {
  double thickness = 0;  // the median over the component's area; infinite where most rays leave it
  double share = 0;      // of the area, whose rays meet another side

  /// What is shorter counts as noise: 0.15 of the thickness; 0 where that is infinite.
  double noise_length() const;
};

/// One a component. `thickness`: one value a face, of thickness_behind_faces().
std::vector<Enclosure> enclosures(const RestShape& shape, const std::vector<double>& thickness);

/// The shape without what is small against its thickness, noise above all: S_r (SurfaceSmoother) of the
/// positions, r = noise_length(). A component whose r is 0 stays as it is. In a unit of its own. Null where it
/// cannot be made: where the factorisation fails, or where nothing that has a size is left.
std::shared_ptr<const RestShape> without_noise(const RestShape& shape,
                                               const std::vector<Enclosure>& components);

}  // namespace lpdeform
