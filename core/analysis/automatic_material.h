#pragma once

#include "absl/status/statusor.h"
#include "core/base/workers.h"
#include "core/energy/material.h"
#include "core/energy/rest_shape.h"

namespace lpdeform {

/// p and stiffness from the geometry: softer at joints, stiffer on rigid parts (section 5 of the paper names this as
/// future work). joint_i is that of core/analysis/joints.h. c in [0, 1] equals the strength where the shape has joints:
///
///   p_i = 2 - c (1 - joint_i)          from 2 - c on rigid parts to 2 at joints
///   s_i = 10^(-c joint_i)              from 1 on rigid parts to 10^-c at joints
///
/// Low p belongs on the rigid parts, not at the joints: with p = 1 the smallest distortion of a cell costs s_i l E_i,
/// so distortion is sparse there and a rigid part moves as one. With p = 2 small distortions are nearly free, so the
/// joints take all of them and share them evenly. With low p at the joints instead, joints would be stiffer than with
/// the same p everywhere. Strength 0 gives p = 2 and stiffness 1 everywhere.
///
/// A shape without joints has no parts to keep rigid, and p = 1 everywhere would kink a tube somewhere. So the effect
/// fades out with J, the largest joint_i: c is the strength times clamp((J - 0.2) / 0.2, 0, 1). For J >= 0.4, c is the
/// strength. For J <= 0.2, c is 0: p = 2 and stiffness 1 everywhere (has_joints). Between the two, the material changes
/// continuously with J.
///
/// The length unit keeps its default. INVALID_ARGUMENT: STRENGTH_OUT_OF_RANGE.
absl::StatusOr<Material> automatic_material(const RestShape& shape, double strength,
                                            const Workers& workers = Workers(1));

/// Whether joint_i exceeds 0.2 anywhere. If it does not, the material is p = 2 and stiffness 1 everywhere.
bool has_joints(const Field& joint);

/// The same for known joints: `joint` has one value per vertex.
absl::StatusOr<Material> automatic_material(const Field& joint, double strength);

/// INVALID_ARGUMENT (STRENGTH_OUT_OF_RANGE) if `strength` is not in [0, 1].
absl::Status check_strength(double strength);

}  // namespace lpdeform
