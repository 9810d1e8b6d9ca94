#pragma once

#include <memory>
#include <vector>

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// What rays inwards from a component's faces meet.
struct Enclosure {
  double thickness = 0;  // the median over the component's area; infinite where most rays leave it
  double share = 0;      // of the area, whose rays meet another side
};

/// One a component. `thickness`: one value a face, of thickness_behind_faces().
std::vector<Enclosure> enclosures(const RestShape& shape, const std::vector<double>& thickness);

/// The shape without what is small against its thickness, noise above all: S_r (SurfaceSmoother) of the positions,
/// r = 0.15 of Enclosure::thickness. A component of infinite thickness stays as it is. In a unit of its own.
/// Null where it cannot be made (a factorisation that fails, nothing left of the shape).
std::shared_ptr<const RestShape> without_noise(const RestShape& shape,
                                               const std::vector<Enclosure>& components);

}  // namespace lpdeform
