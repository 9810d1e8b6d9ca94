#include "core/analysis/shape_features.h"

#include "core/analysis/joints.h"
#include "core/analysis/salience.h"

namespace lpdeform {

const Field& ShapeFeatures::joint() const {
  const std::scoped_lock lock(mutex_);
  if (!joint_) joint_ = find_joints(*shape_, workers_).joint;
  knows_joint_ = true;
  return *joint_;
}

const BendingMeasure& ShapeFeatures::bending() const {
  const std::scoped_lock lock(mutex_);
  if (!bending_) bending_ = smoothed_bending(*shape_);
  knows_bending_ = true;
  return *bending_;
}

}  // namespace lpdeform
