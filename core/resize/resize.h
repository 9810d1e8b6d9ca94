#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/analysis/shape_features.h"
#include "core/energy/material.h"
#include "core/problem/handles.h"

namespace lpdeform {

/// A scaling by different factors along three axes: x -> origin + sum_k scale_k u_k u_k^T (x - origin).
struct Scaling {
  /// 0.01 <= scale_k <= 100.
  Eigen::Vector3d scale = Eigen::Vector3d::Ones();
  /// In the caller's units.
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  /// u_k: rows, orthonormal.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();

  Points operator()(const Points& points) const;

  static constexpr double kLowest = 0.01, kHighest = 100;
};

/// The axes from two directions of any length: the first, the part of the second across it, and what is
/// across both. INVALID_ARGUMENT: RESIZE_AXES where they are not finite or too nearly parallel (a sine below
/// 1e-6).
absl::StatusOr<Eigen::Matrix3d> axes_of(const Eigen::Vector3d& x_axis, const Eigen::Vector3d& y_axis);

/// INVALID_ARGUMENT: RESIZE_SCALE_OUT_OF_RANGE, RESIZE_ORIGIN_NOT_FINITE.
absl::Status check_scaling(const Scaling& scaling);

/// What makes a Deformer resize: held places and a material.
struct ResizeInputs {
  Handle handle;
  Material material;
};

/// Content-aware resizing (section 5 of the paper names it): the ends along scaled axes go where the scaled shape has them, and
/// what is salient keeps its shape and size as far as axes are stretched, by the energy of Eq. 3 against the rest shape.
///
/// The handle holds the ends of each component, the vertices within 1 % of its extent from its lowest and
/// highest along each axis whose scale is not 1, at their scaled positions; where all are 1, the ends along
/// the first axis. Nothing holds the shape across these axes, where its extent changes by up to a fifth when
/// others are doubled. For the extent of the scaled shape along all three, as `lpdeform resize` gives it: one solve for each
/// axis, from the result before it, with the handles of side_locks added, and with_extents of what comes out
/// (resize_extents.h).
///
/// The material is p = 1 and the stiffness
///
///   s_i = 100^salience_i min(6^4, prod_k clamp(girth_ik / 0.75, 1/6, 1)^(-4 a_k)),    a_k = |log scale_k| / max_j |log scale_j|
///
/// with the salience of core/analysis/salience.h for the axes, weighted a_k, and the girth of core/analysis/girth.h
/// along axis k. A stretch goes where a cut costs least: without the second factor that is close to the ends, where
/// slices are small, and a tip is drawn out into a spike.
///
/// A component of which less than half is spared (core/resize/sparing.h), as a ball or an ellipsoid, is held whole: all its
/// vertices where the plain scaling has them; where none is spared, the material is p = 2. With the above a ball became a
/// ball with two cones: its slices are cheapest some way from the ends, and p = 1 gathers the whole stretch there. A handle
/// holds a vertex or does not, so this is a switch; `lpdeform resize` blends the two results.
///
/// p = 1 matters: it gathers the stretch in places where little resists, which are straight along the
/// stretch, so that it does not show there. p = 2 spreads it over salient places too, however stiff they are.
/// A factor that all axes share is no change of shape: scale the mesh by the least of them first (shared_factor), so
/// that what is left only stretches. What is salient then keeps its shape, and has the size that this factor gives it.
///
/// INVALID_ARGUMENT: RESIZE_SCALE_OUT_OF_RANGE, RESIZE_ORIGIN_NOT_FINITE. `axes` must be orthonormal.
absl::StatusOr<ResizeInputs> resize_inputs(const ShapeFeatures& features, const Scaling& scaling);

/// With components chosen by the caller: not 0 where one is spared.
absl::StatusOr<ResizeInputs> resize_inputs(const ShapeFeatures& features, const Scaling& scaling,
                                           const std::vector<char>& is_spared);

/// a_k above; (1, 0, 0) where all scales are 1.
Eigen::Vector3d stretch_shares(const Eigen::Vector3d& scale);

/// The least of the three factors. Over it, all three are stretches: by a factor below 1 an axis would be pushed, and a
/// thin surface that is pushed buckles.
double shared_factor(const Eigen::Vector3d& scale);

/// The middle of the bounding box of the vertices that faces use: the origin where none is given.
Eigen::Vector3d box_middle(const RestShape& shape);

}  // namespace lpdeform
