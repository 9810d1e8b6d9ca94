#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <optional>

#include "core/analysis/bending.h"
#include "core/base/workers.h"
#include "core/energy/rest_shape.h"

namespace lpdeform {

/// Results about a shape's geometry, each computed when it is first asked for and then kept. Thread-safe: a caller that
/// asks for a result while another thread computes it waits for that thread. Shares the shape; copies nothing of it.
class ShapeFeatures {
 public:
  explicit ShapeFeatures(std::shared_ptr<const RestShape> shape, Workers workers = Workers(1))
      : shape_(std::move(shape)), workers_(std::move(workers)) {}

  const RestShape& shape() const { return *shape_; }
  /// Joints::joint.
  const Field& joint() const;
  /// smoothed_bending of core/analysis/salience.h.
  const BendingMeasure& bending() const;
  /// Whether joint() or bending() has been computed already, so that it returns at once. Does not wait.
  bool knows_joint() const { return knows_joint_; }
  bool knows_bending() const { return knows_bending_; }

 private:
  const std::shared_ptr<const RestShape> shape_;
  const Workers workers_;
  mutable std::mutex mutex_;
  mutable std::optional<Field> joint_;
  mutable std::optional<BendingMeasure> bending_;
  mutable std::atomic<bool> knows_joint_ = false, knows_bending_ = false;
};

}  // namespace lpdeform
