#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/analysis/shape_features.h"
#include "core/energy/material.h"
#include "core/problem/handles.h"
#include "core/resize/scaling.h"

namespace lpdeform {

/// The inputs that make a Deformer resize: a handle and a material.
struct ResizeInputs {
  Handle handle;
  Material material;
};

/// Content-aware resizing (future work in section 5 of the paper). The ends along scaled axes move to their positions
/// in the scaled shape. Salient parts keep their shape and size as far as axes are stretched, through the energy of
/// Eq. 3 against the rest shape.
///
/// The handle holds the ends of each component at their scaled positions. Ends are the vertices within 1 % of the
/// component's extent from its lowest or highest coordinate along an axis whose scale is not 1; if all scales are 1,
/// along the first axis. Nothing holds the shape along the other axes; its extent there changes by up to a fifth when
/// other axes are doubled. To get the extents of the scaled shape along all three axes, as `lpdeform resize` does: make
/// one solve per axis, each from the previous result and with the handles of side_locks added, and apply with_extents
/// to the result (resize_extents.h).
///
/// The material is p = 1 and the stiffness
///
///   s_i = 100^salience_i min(6^4, prod_k clamp(girth_ik / 0.75, 1/6, 1)^(-4 a_k)),    a_k = |log scale_k| / max_j |log scale_j|
///
/// salience_i is that of core/analysis/salience.h for the axes, weighted by a_k; girth_ik is that of
/// core/analysis/girth.h along axis k. A stretch concentrates where a slice through the shape costs least. Without the
/// second factor this is close to the ends, where slices are small, and a tip would be drawn out into a spike.
///
/// If the sparing of a component (core/resize/sparing.h) is below one half, as for a ball or an ellipsoid, all its
/// vertices are held where the three factors bring them, without sparing. If no component is spared, the material is
/// p = 2. Otherwise a ball would become a ball with two cones: its slices are cheapest at some distance from the ends, and
/// p = 1 gathers the whole stretch there. A handle either holds a vertex or does not, so this is a hard switch; `lpdeform
/// resize` blends the two results.
///
/// p = 1 is essential: it gathers the stretch in places of low resistance. These are straight along the stretch, so the
/// stretch is not visible there. p = 2 would spread the stretch over salient places as well, however stiff they are. A
/// factor that all axes have in common does not change the shape. Scale the mesh by the smallest of the three factors
/// first (shared_factor); the remaining factors then only stretch. Salient parts then keep their shape, at the size
/// that this common factor gives them.
///
/// INVALID_ARGUMENT: RESIZE_SCALE_OUT_OF_RANGE, RESIZE_ORIGIN_NOT_FINITE. `axes` must be orthonormal.
absl::StatusOr<ResizeInputs> resize_inputs(const ShapeFeatures& features, const Scaling& scaling);

/// The same with components chosen by the caller: `is_spared` has one entry per component, not 0 if it is spared.
absl::StatusOr<ResizeInputs> resize_inputs(const ShapeFeatures& features, const Scaling& scaling,
                                           const std::vector<char>& is_spared);

/// The smallest of the three factors. Divided by it, all three factors are at least 1, so every axis is stretched or
/// unchanged. A factor below 1 would compress an axis, and a thin surface buckles under compression.
double shared_factor(const Eigen::Vector3d& scale);

/// The middle of the bounding box of the vertices that faces use. It is the default origin of a resizing.
Eigen::Vector3d box_middle(const RestShape& shape);

}  // namespace lpdeform
