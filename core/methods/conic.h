#pragma once

#include <optional>

#include "core/methods/conic_step.h"
#include "core/methods/minimiser.h"

namespace lpdeform {

/// The paper's section 3.3 for p = 1: alternates a second-order cone program for the positions (ConicStep) with a
/// rotation fit. An iteration is one iteration of the interior-point method. A stage is one cone program, solved to a
/// relative duality gap of 1e-8 or as far as rounding allows; if that gap is above 1e-6, the method breaks down. The
/// state is the best point of the stage.
///
/// Converged when a whole stage's root-mean-square displacement is below 0.01 l * tolerance /
/// SolveSettings::kDefaultTolerance (the paper's epsilon_C at the default). If the handles have moved by less than
/// that, the solve ends with the first program, whose rotations are those of the initial guess. The certificate then
/// shows the remaining gap.
class Conic : public Minimiser {
 public:
  /// Requires p = 1 everywhere.
  Conic(Problem problem, Points x);

  StepResult step() override;
  const Points& x() const override { return x_; }

  static constexpr double kDisplacement = 0.01, kGap = 1e-8, kAcceptableGap = 1e-6;
  /// A program counts as stuck if its gap has not fallen by 1 % in this many iterations.
  static constexpr int kPatience = 50;

 private:
  void begin_stage();
  StepResult end_stage();
  bool gets_further();  // called once per iteration

  Problem problem_;
  Points x_, stage_start_;
  std::optional<ConicStep> cone_;
  double objective_ = 0;  // at x_ with the stage's rotations
  int stage_ = -1;
  double gap_ = 0;       // the lowest gap of the stage, in steps of at least 1 %
  int since_lower_ = 0;  // iterations since gap_ was last lowered
};

}  // namespace lpdeform
