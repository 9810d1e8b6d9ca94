#pragma once

#include "core/mesh/mesh.h"

namespace lpdeform {

/// Surface of a box of nx x ny x nz unit cells, one corner at the origin, each cell side two
/// triangles, outward orientation, vertices shared. box_surface(4, 4, 21) has the 370 vertices and 736 faces
/// of the paper's bar (Fig. 4), box_surface(2, 30, 60) the 3962 and 7920 of its sheet (Fig. 3). nx, ny, nz
/// >= 1.
TriangleMesh box_surface(int nx, int ny, int nz);

/// A grid of nx x ny unit cells in the plane z = 0, open boundary; with five by five bumps of height `bump`
/// where not 0.
TriangleMesh grid(int nx, int ny, double bump = 0.0);

/// A block of nx x ny x nz unit cells with three square tunnels cut through it along z (genus 3), like the
/// paper's block (Fig. 5). nx >= 7, ny >= 3, nz >= 1.
TriangleMesh block_with_holes(int nx, int ny, int nz);

/// Unit sphere from an icosahedron subdivided `levels` times: 10 * 4^levels + 2 vertices.
TriangleMesh sphere(int levels);

/// A creature-like blob: a closed surface with four legs, a neck and a tail, made from a field of blended
/// capsules sampled on a grid of `resolution` cells along its length. Manifold, one component. resolution
/// >= 24.
TriangleMesh creature(int resolution);

}  // namespace lpdeform
