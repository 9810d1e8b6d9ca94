#pragma once

#include "core/base/colour.h"
#include "core/base/geometry.h"

namespace lpdeform {

/// The colour of a matt surface lit from the viewer's upper left, with a weak light from the right and a sky
/// above. Normals and directions are in the camera's axes (right, up, towards the camera) and have length 1.
/// The normal is on the viewer's side. `openness`, 0 to 1, is the share of the sky that the point sees.
Rgb shaded(Rgb albedo, const Eigen::RowVector3d& normal, const Eigen::RowVector3d& towards_camera,
           double openness);

/// The light grey background; `down` goes from 0 at the top to 1 at the bottom.
Rgb background(double down);

}  // namespace lpdeform
