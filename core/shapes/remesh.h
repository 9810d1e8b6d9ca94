#pragma once

#include "core/mesh/mesh.h"
#include "core/shapes/tetrahedra_surface.h"

namespace lpdeform {

/// Makes the triangles of a closed manifold surface of `field` well shaped. It first collapses edges shorter than
/// `shortest_edge` if the surface stays a manifold. Then, `rounds` times, it flips edges towards Delaunay and moves
/// each vertex to the mean of its neighbours and back onto field = 0. The field's gradient must have about unit length.
TriangleMesh remesh(const TriangleMesh& mesh, const ImplicitField& field, double shortest_edge, int rounds);

}  // namespace lpdeform
