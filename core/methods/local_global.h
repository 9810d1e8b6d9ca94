#pragma once

#include "core/methods/minimiser.h"

namespace lpdeform {

/// As-rigid-as-possible surface modeling (Sorkine & Alexa 2007), p = 2: rotations fitted for given positions,
/// then positions solved for given rotations, which is one Newton step x - M^-1 grad with the constant matrix
/// M (see Metric).
///
/// Converged when the decrease of the last three iterations is at most 3 * tolerance * E.
class LocalGlobal : public Minimiser {
 public:
  /// Needs p = 2 everywhere. `x` is the initial guess.
  LocalGlobal(Problem problem, Points x);

  StepResult step() override;
  const Points& x() const override { return x_; }

 private:
  Problem problem_;
  Points x_, gradient_;
  double objective_ = 0;
  int small_decreases_ = 0;
  bool is_factored_ = false;
};

}  // namespace lpdeform
