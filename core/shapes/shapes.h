#pragma once

#include "core/mesh/mesh.h"

namespace lpdeform {

/// The surface of a box of nx x ny x nz unit cells with one corner at the origin. Each cell side is two triangles,
/// oriented outwards; vertices are shared. box_surface(4, 4, 21) has the 370 vertices and 736 faces of the paper's bar
/// (Fig. 4), box_surface(2, 30, 60) the 3962 vertices and 7920 faces of its sheet (Fig. 3). nx, ny, nz >= 1.
TriangleMesh box_surface(int nx, int ny, int nz);

/// A grid of nx x ny unit cells in the plane z = 0 with open boundary. If `bump` is not 0, it has five by five bumps of
/// that height.
TriangleMesh grid(int nx, int ny, double bump = 0.0);

/// A block of nx x ny x nz unit cells with three square tunnels cut through it along z (genus 3). nx >= 7,
/// ny >= 3, nz >= 1.
TriangleMesh block_with_holes(int nx, int ny, int nz);

/// A bar of side x side x length cells along z. Its middle `neck_length` slices are narrowed to neck_side x neck_side
/// cells about the axis, which gives two rigid parts and a joint. side - neck_side must be even; 1 <=
/// neck_side <= side, 0 <= neck_length < length.
TriangleMesh necked_bar(int side, int length, int neck_side, int neck_length);

/// Unit sphere from an icosahedron subdivided `levels` times: 10 * 4^levels + 2 vertices.
TriangleMesh sphere(int levels);

/// A creature-like blob: a closed surface with four legs, a neck and a tail, made from a field of blended
/// capsules sampled on a grid of `resolution` cells along its length. Manifold, one component.
/// resolution >= 24.
TriangleMesh creature(int resolution);

/// A bust as a scanner might give it: a rough surface of one component with seven holes, and vertices that are off it by
/// up to 0.2 edge lengths. Generated like the creature. resolution >= 24 is the number of cells along z.
TriangleMesh scan(int resolution);

/// A trunk along z with four levels of forks: 31 tubes, whose radius falls from 0.09 to 0.02. Generated like the
/// creature. resolution >= 48 is the number of cells along the longest side.
TriangleMesh tube_tree(int resolution);

/// Measures of pierced_block.
struct PiercedBlock {
  static constexpr double kHalfSide = 10, kHalfLength = 19, kHoleRadius = 5.5;
};
/// A cube around the origin, crossed by two round tunnels along x and y, with round shafts along z above and below it
/// (genus 3), similar to the paper's block (Fig. 5). Its edges are slightly rounded. Generated like the creature.
/// pierced_block(34) has about as many vertices as the paper's block. resolution >= 24 is the number of cells along z.
TriangleMesh pierced_block(int resolution);

/// Measures of rocker_arm.
struct RockerArm {
  static constexpr double kHoleRadius = 0.18;
};
/// A rocker arm of length 1.8 along x (genus 1), similar to the paper's (Fig. 7): a ring around the z axis with a tail
/// on one side and, on the other, an arm that ends in a round head. Generated like the creature. resolution >= 32 is
/// the number of cells along x.
TriangleMesh rocker_arm(int resolution);

}  // namespace lpdeform
