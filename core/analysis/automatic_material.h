#pragma once

#include "absl/status/statusor.h"
#include "core/base/workers.h"
#include "core/energy/material.h"
#include "core/energy/rest_shape.h"

namespace lpdeform {

/// p and stiffness from the geometry: softer at joints, stiffer on rigid parts (section 5 of the paper names
/// this as future work). With joint_i of core/analysis/joints.h, and c in [0, 1], which is the strength where
/// there are joints:
///
///   p_i = 2 - c (1 - joint_i)          2 at joints; on rigid parts 2 - c
///   s_i = 10^(-c joint_i)              1 on rigid parts; at joints down to 1/10
///
/// Low p belongs on the rigid parts, not at the joints: with p = 1 the smallest distortion of a cell costs
/// s_i l E_i, so distortion is sparse there and a rigid part moves as one, while with p = 2 small distortions
/// are nearly free, so the joints take all of them and share them evenly. The other way round joints are
/// stiffer than with the same p everywhere. Strength 0 is p = 2 and stiffness 1 everywhere.
///
/// Without joints there are no parts to be kept rigid, and p = 1 everywhere would kink a tube somewhere. So the
/// effect fades with J, the largest joint_i: c is the strength times clamp((J - 0.2) / 0.2, 0, 1). From J = 0.4
/// on it is the whole strength. Up to J = 0.2 it is nothing: p = 2 and stiffness 1 everywhere (has_joints).
/// Between, the material changes continuously with J.
///
/// The length unit is left at its default. INVALID_ARGUMENT: STRENGTH_OUT_OF_RANGE.
absl::StatusOr<Material> automatic_material(const RestShape& shape, double strength,
                                            const Workers& workers = Workers(1));

/// Whether joint_i exceeds 0.2 anywhere: where not, the material is p = 2 and stiffness 1 everywhere.
bool has_joints(const Field& joint);

/// The same where the joints are known: one value of `joint` a vertex.
absl::StatusOr<Material> automatic_material(const Field& joint, double strength);

/// INVALID_ARGUMENT (STRENGTH_OUT_OF_RANGE) where `strength` is not within 0 to 1.
absl::Status check_strength(double strength);

}  // namespace lpdeform
