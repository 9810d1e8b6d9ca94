#pragma once

#include "core/methods/minimiser.h"

namespace lpdeform {

/// The paper's section 3.2: gradient descent (Eq. 10) with a backtracking line search, alpha = 0.3, beta = 0.5. The
/// search starts at t = 1, for positions in units of the length l. Rotations are fitted in every evaluation.
///
/// Converged when the root-mean-square displacement of an iteration, sqrt(sum_i |dx_i|^2 / n), is below
/// 5e-5 l * tolerance / SolveSettings::kDefaultTolerance (the paper's epsilon_L at the default), or
/// when E is 0 to rounding.
class LineSearch : public Minimiser {
 public:
  /// `problem.norm` must have the reference length l (see LpNorm), so that its value is E in units of l.
  LineSearch(Problem problem, Points x);

  StepResult step() override;
  const Points& x() const override { return x_; }

  static constexpr double kAlpha = 0.3, kBeta = 0.5, kDisplacement = 5e-5;

 private:
  Problem problem_;
  Points x_, gradient_, trial_;
  double objective_ = 0;
};

}  // namespace lpdeform
