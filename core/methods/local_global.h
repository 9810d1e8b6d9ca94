#pragma once

#include "core/methods/minimiser.h"

namespace lpdeform {

/// The local/global method of as-rigid-as-possible surface modeling (Sorkine & Alexa 2007), p = 2. The local step fits
/// rotations for given positions. The global step solves for positions with given rotations, which is one Newton step x
/// - M^-1 grad with the constant, prefactored matrix M (see Metric).
///
/// Converged when each of three consecutive iterations has decreased E by at most tolerance * E, or when E is 0.
class LocalGlobal : public Minimiser {
 public:
  /// Requires p = 2 everywhere. `x` is the initial guess.
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
