#pragma once

#include "core/base/workers.h"
#include "core/energy/rest_shape.h"

namespace lpdeform {

/// Where a shape would bend if it were made of rigid parts: at concave creases, where parts meet, and at places that
/// are narrower than their surroundings, including thin ends. Computed from the geometry alone.
///
/// Noise at the scale of edges does not count as a joint: everything is measured on the result of without_noise()
/// (core/analysis/enclosure.h).
///
/// The distance of measurement is rho (core/analysis/component_lengths.h). S_r is the smoothing of SurfaceSmoother with
/// length r.
///
///   B         = S_rho[bending measure of core/analysis/bending.h],  a curvature
///   theta_i   = 2 rho max(0, -lowest eigenvalue of B_i)             the angle of the crease, in radians. At the
///               edge of a single straight concave crease in a plane, this is the crease's angle
///   a_r       = S_r[1 / t^2] / S_r[1 / t],  t the thickness behind a face (core/analysis/thickness.h),
///               at least Enclosure::noise_length()
///   n_i       = max(0, a_rho / a_{4 rho} - 1)                       how much narrower than the surroundings
///   joint     = S_rho[1 - 1 / (1 + (theta / 20 degrees)^2) / (1 + (n / 0.25)^2)]
///
/// A surface that encloses nothing has no inside, so a fold in either direction is a crease. With h = S_rho[1 where a
/// ray meets another side, 0 elsewhere] and H the share of the component's area where a ray does,
///
///   o_i       = (1 - h_i) max(0, 1 - 2 H)
///   theta_i   = 2 rho max(0, -lowest, o_i highest)
///
/// H keeps the convex edges of a solid from counting as creases. Rays from faces that noise has tilted leave the solid
/// near its edges, so h alone would classify those places as open.
struct Joints {
  Field crease_radians;  // theta_i >= 0
  Field narrowing;       // n_i >= 0
  Field joint;           // in [0, 1]: 0 on rigid parts
};

/// The fields are smooth over the surface. Except for rounding, they do not depend on the unit of length, on position
/// and rotation of the mesh, or on the order of vertices and faces. They are always finite, also for meshes with
/// zero-area faces, boundaries, non-manifold edges and several components, and 0 for vertices that no face uses. O(n
/// log n) plus three sparse factorisations.
Joints find_joints(const RestShape& shape, const Workers& workers);

}  // namespace lpdeform
