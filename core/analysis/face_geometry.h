#pragma once

#include "core/energy/rest_shape.h"

namespace lpdeform {

/// A face of a rest shape in scaled units.
struct FaceGeometry {
  Eigen::RowVector3d centre;
  Eigen::RowVector3d normal;  // unit length; outwards if the mesh is oriented so; 0 for a zero-area face
  double area = 0;            // 0 for a zero-area face (core/mesh/topology.h)
};

FaceGeometry face_geometry(const RestShape& shape, Eigen::Index face);

/// A third of the area of each vertex's faces, in scaled units.
Field vertex_areas(const RestShape& shape);

}  // namespace lpdeform
