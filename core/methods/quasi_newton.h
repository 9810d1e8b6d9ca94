#pragma once

#include <deque>
#include <vector>

#include "core/methods/minimiser.h"
#include "core/methods/pair_memory.h"

namespace lpdeform {

/// What a solve finds at its beginning.
enum class Warmth {
  kCold,
  kPrepared,    // what a coarse level found
  kWarm,        // the state of the solve before, in a live session
  kWithMetric,  // and the metric that it ended with
};

/// Limited-memory BFGS (Nocedal & Wright, algorithm 7.4) on E(x) with the reweighted Laplacian as its initial
/// metric (after Liu et al. 2017), t = 1 first, backtracking by interpolation. The default for every p. Where p_i > 2,
/// a cell counts in the metric at least as much as such cells do on the average: with c_i ~ E_i^(p_i - 2) alone a
/// cell that is at rest hardly counts, each step throws its energy up, and the search makes the step short.
///
/// Where some p_i < 2 it runs through stages: p from 2 towards p_i, then cell energies smoothed with an eps
/// that falls until it does not matter. Each stage begins with a metric refactored for the present cell
/// weights and an empty memory. Every 40th iteration refactors too, and one after a shortened step, which says
/// that the weights have changed. The last step is remembered then, in the new metric: without it p > 2 and shallow
/// valleys take two to three times the iterations. Where no weight has changed (p = 2), all are. In a live session
/// it starts at p_i with an eps that adds at most a tenth to the mean cell's E^p, and for its first ten iterations
/// keeps the metric that it finds. Where the largest p_i is over 12 and none below 2, a cold solve has one stage near p = 4
/// first: it takes fewer iterations in all, and straight on a bent grid folds.
///
/// Converged when, in the last stage, the objective f fell over 20 iterations by at most tolerance * p * f, p
/// the largest p_i (a relative decrease of E^(1/p) of at most the tolerance); or when no step lowers f and
/// the decrease that the fresh metric promises, -<gradient, direction> / 2, is at most that; or when E is 0
/// to rounding. Where p is mixed, f is meant without what smoothing adds to cells of p_i < 2: beside large p that can be more
/// than all the energy there is. Stalled where cells of p_i < 2 are at rounding and what this leaves of them is over a hundredth of the
/// rest, as with p = 1 and 10 side by side.
class QuasiNewton : public Minimiser {
 public:
  QuasiNewton(Problem problem, Points x, Warmth warmth);

  StepResult step() override;
  const Points& x() const override { return x_; }

 private:
  void begin_stage(bool keeps_metric = false);
  double mean_energy() const;
  double first_smoothing(Warmth warmth, double lowest_p) const;
  double smoothing_sum() const;
  bool is_smooth_enough() const;
  bool is_end_true() const;
  std::vector<double> metric_weights() const;
  bool adopt_metric();
  void find_gradient();
  void forget();
  bool refresh_metric();
  double direction();
  void go_along(double t);
  double search(double slope);
  void accept(double length);
  StepResult give_up(double slope);
  bool is_stage_over() const;
  StepResult result(Outcome outcome);

  Problem problem_;
  std::vector<double> shares_;  // of the way from 2 to p_i, for the first stages
  double eps2_ = 0;             // smoothing
  int stage_ = 0;
  bool is_last_stage_ = false;
  LpNorm norm_;  // of the stage
  bool is_true_norm_ = false;
  Points x_, trial_, direction_;
  Points gradient_, gradient_before_;              // before the last step
  Points preconditioned_, preconditioned_before_;  // M^-1 times them
  double last_length_ = 1;                         // of a step
  double step_length_ = 0;                         // of the last step along direction_, not yet remembered
  double objective_ = 0;
  double smoothing_sum_ = 0;  // in objective_, where p is mixed and the stage the last
  double true_sum_ = 0;       // of problem_.norm at x_
  PairMemory memory_;
  std::deque<double> history_;  // objectives of the stage's last 21 iterations
  int stage_iterations_ = 0, since_refresh_ = 0;
  bool is_metric_good_ = false;
};

}  // namespace lpdeform
