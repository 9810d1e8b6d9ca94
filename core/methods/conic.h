#pragma once

#include <optional>

#include "core/methods/conic_step.h"
#include "core/methods/minimiser.h"

namespace lpdeform {

/// The paper's section 3.3 for p = 1: a second-order cone program for the positions (ConicStep) and a
/// rotation fit, in turn. An iteration is one of the interior-point method; a stage is one cone program,
/// solved to a relative duality gap of 1e-8, or as far as rounding allows: at most 1e-6, else it breaks down. The
/// state is the best point of the stage.
///
/// Converged when a whole stage's root-mean-square displacement is below 0.01 l * tolerance /
/// SolveSettings::kDefaultTolerance (the paper's epsilon_C at the default). Handles that move by less than that end it
/// with the first program, whose rotations are those of the initial guess; the certificate shows what is left.
class Conic : public Minimiser {
 public:
  /// Needs p = 1 everywhere.
  Conic(Problem problem, Points x);

  StepResult step() override;
  const Points& x() const override { return x_; }

  static constexpr double kDisplacement = 0.01, kGap = 1e-8, kAcceptableGap = 1e-6;
  /// A program whose gap is no lower after so many iterations than before them, by a hundredth of it, gets no further.
  static constexpr int kPatience = 50;

 private:
  void begin_stage();
  StepResult end_stage();
  bool gets_further();  // asked once an iteration

  Problem problem_;
  Points x_, stage_start_;
  std::optional<ConicStep> cone_;
  double objective_ = 0;  // of x_ with the stage's rotations
  int stage_ = -1;
  double gap_ = 0;       // lowest of the stage, by steps of a hundredth
  int since_lower_ = 0;  // iterations since then
};

}  // namespace lpdeform
