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

/// A block of nx x ny x nz unit cells with three square tunnels cut through it along z (genus 3). nx >= 7, ny
/// >= 3, nz >= 1.
TriangleMesh block_with_holes(int nx, int ny, int nz);

/// A bar of side x side x length cells whose middle `neck_length` slices are narrowed to neck_side x
/// neck_side cells about the axis along z: two rigid parts and a joint. side - neck_side even; 1 <= neck_side
/// <= side, 0 <= neck_length < length.
TriangleMesh necked_bar(int side, int length, int neck_side, int neck_length);

/// Unit sphere from an icosahedron subdivided `levels` times: 10 * 4^levels + 2 vertices.
TriangleMesh sphere(int levels);

/// A creature-like blob: a closed surface with four legs, a neck and a tail, made from a field of blended
/// capsules sampled on a grid of `resolution` cells along its length. Manifold, one component. resolution
/// >= 24.
TriangleMesh creature(int resolution);

/// Measures of pierced_block.
struct PiercedBlock {
  static constexpr double kHalfSide = 10, kHalfLength = 19, kHoleRadius = 5.5;
};
/// A cube around the origin that two round tunnels cross, one along x, one along y, with a round shaft along z
/// above and below it (genus 3): the kind of the paper's block (Fig. 5). Edges a little rounded; made as the
/// creature is. pierced_block(34) has about as many vertices as the paper's. resolution >= 24, the cells along
/// z.
TriangleMesh pierced_block(int resolution);

/// Measures of rocker_arm.
struct RockerArm {
  static constexpr double kHoleRadius = 0.18;
};
/// A rocker arm of length 1.8 along x (genus 1): a ring around the z axis with a tail to one side and an arm to
/// the other, which ends in a round head: the kind of the paper's (Fig. 7). Made as the creature is. resolution
/// >= 32, the cells along x.
TriangleMesh rocker_arm(int resolution);

}  // namespace lpdeform
