#include "core/analysis/automatic_material.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "core/analysis/joints.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

constexpr double kJointP = 2;
constexpr double kSoftening = 10;

// The values of the largest joint at which p begins to differ from 2, and at which the full strength is reached. On
// tubes of 12 to 48 faces around, noise of 5 % of the radius leaves joints of up to 0.17. Each shape with joints that
// lpdeform generates has a largest joint of 0.48 or more.
constexpr double kNoJoint = 0.2, kWholeJoint = 0.4;

double largest(const Field& joint) {
  return joint.size() > 0 ? joint.maxCoeff() : 0;
}

}  // namespace

absl::Status check_strength(double strength) {
  if (strength >= 0 && strength <= 1) return absl::OkStatus();
  return make_fault({Reason::kStrengthOutOfRange, "strength", "0 <= strength <= 1"},
                    absl::StrCat("the strength is ", strength, "; it must be from 0 to 1"));
}

bool has_joints(const Field& joint) {
  return largest(joint) > kNoJoint;
}

absl::StatusOr<Material> automatic_material(const Field& joint, double strength) {
  if (absl::Status status = check_strength(strength); !status.ok()) return status;
  Material material;
  if (strength == 0 || !has_joints(joint)) return material;
  const double c = strength * std::min(1.0, (largest(joint) - kNoJoint) / (kWholeJoint - kNoJoint));
  material.p = kJointP - c * (1 - joint.array());
  material.stiffness = (-c * std::log(kSoftening) * joint.array()).exp();
  return material;
}

absl::StatusOr<Material> automatic_material(const RestShape& shape, double strength, const Workers& workers) {
  if (absl::Status status = check_strength(strength); !status.ok()) return status;
  if (strength == 0) return Material();
  return automatic_material(find_joints(shape, workers).joint, strength);
}

}  // namespace lpdeform
