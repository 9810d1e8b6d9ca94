#pragma once

#include "core/base/workers.h"
#include "core/energy/rest_shape.h"

namespace lpdeform {

/// Where a shape would bend if it were made of parts that are rigid: at concave creases, where parts meet,
/// and at places narrower than what is around them, thin ends among them. From the geometry alone.
///
/// Noise at the scale of edges is no joint: all is measured on the shape that without_noise() of
/// core/analysis/enclosure.h gives.
///
/// All is measured at the distance rho of core/analysis/component_lengths.h; S_r is the smoothing of
/// SurfaceSmoother with length r.
///
///   B         = S_rho[bending measure of core/analysis/bending.h],  a curvature
///   theta_i   = 2 rho max(0, -lowest eigenvalue of B_i)             the angle of the crease, in radians: of
///               a straight concave crease alone in a plane, at its edge, the angle itself
///   a_r       = S_r[1 / t^2] / S_r[1 / t],  t the thickness behind a face (core/analysis/thickness.h),
///               at least Enclosure::noise_length()
///   n_i       = max(0, a_rho / a_{4 rho} - 1)                       how much narrower than around
///   joint     = S_rho[1 - 1 / (1 + (theta / 20 degrees)^2) / (1 + (n / 0.25)^2)]
///
/// A surface that encloses nothing has no inside, and either way of folding is a crease. With
/// h = S_rho[1 where a ray meets another side, 0 elsewhere] and H the component's share of such area,
///
///   o_i       = (1 - h_i) max(0, 1 - 2 H)
///   theta_i   = 2 rho max(0, -lowest, o_i highest)
///
/// H keeps the convex edges of a solid from being creases: rays from faces that noise has turned leave the
/// solid beside its edges, so that h alone takes those places for open.
struct Joints {
  Field crease_radians;  // theta_i >= 0
  Field narrowing;       // n_i >= 0
  Field joint;           // in [0, 1]: 0 on rigid parts
};

/// Smooth over the surface; does not depend on the unit of length, on where the mesh lies and how it is
/// turned, nor on the order of vertices and faces, but for rounding. Always finite, also for meshes with
/// zero-area faces, boundaries, non-manifold edges and several components; 0 for vertices that no face uses.
/// O(n log n) but for three sparse factorisations.
Joints find_joints(const RestShape& shape, const Workers& workers);

}  // namespace lpdeform
