#pragma once

#include <cstddef>
#include <deque>
#include <vector>

#include "core/methods/lbfgs_memory.h"
#include "core/methods/minimiser.h"

namespace lpdeform {

/// What a solve starts from.
enum class Warmth {
  kCold,        // an initial guess
  kPrepared,    // the result of a coarse level
  kWarm,        // warm start: the state of the previous solve, in a live session; or that of a graded level
  kWithMetric,  // a warm start that also keeps the previous solve's metric
};

/// Limited-memory BFGS (Nocedal & Wright, algorithm 7.4) on E(x) with the reweighted Laplacian as initial metric (after
/// Liu et al. 2017). The line search starts at t = 1 and backtracks by interpolation. The default for every p. In the
/// metric, the weight of a cell with p_i > 2 is at least the mean weight of such cells. Without this bound,
/// an undeformed cell would have the weight c_i ~ E_i^(p_i - 2), almost 0; each step would raise its energy sharply, and
/// the line search would backtrack.
///
/// If some p_i < 2, the method runs in stages (continuation): p goes from 2 towards p_i, then cell energies are
/// smoothed by eps, which is decreased until it adds little to E: at most the tolerance as a share of E, or 0.03 % where the
/// tolerance is smaller, or 1 % where it is larger. At the start of each stage the metric is
/// refactored with the current cell weights, and the memory is cleared. The metric is also refactored every 40th
/// iteration, and after a shortened step, which shows that the weights have changed. The memory then keeps the last pair,
/// in the new metric; without it, p > 2 and shallow valleys take two to three times as many iterations. If no weight has
/// changed (p = 2), all pairs are kept. In a live session the method starts at p_i with an eps that adds at most a tenth
/// to the mean cell's E^p, and keeps the previous metric for its first ten iterations, or for its first stage if that is shorter.
/// If the lowest p_i < 1.1 and no p_i > 2, the first stage of such a solve also ends where, after ten iterations or more, the last five
/// have gained little compared with what smoothing adds. Frames of a small move then go a straighter way. Further starts of a search
/// count as a live session here.
///
/// If no p_i is below 2 and the largest is over 12, a cold solve first has one stage near p = 4. This takes fewer
/// iterations in total; without it, a bent grid folds. If the largest is over 4, a solve that starts from a coarse level
/// first makes 20 iterations near p = 4, which even out what the prolongation has left.
///
/// f is the objective of the last stage, f_k after k of its iterations, g its gradient, d the direction, p the largest p_i.
/// Converged where
///
///   f_(k-20) - f_k <= tolerance p f_k , a relative decrease of E^(1/p) of at most the tolerance; or
///   -<g, d> / 2 <= tolerance p f_k with a fresh metric and no decreasing step; or
///   E = 0 to rounding.
///
/// If p varies, the f_k on the right of the first leaves out what smoothing adds to cells with p_i < 2, because next to a
/// large p this part can exceed all other energy. Stalled where, with F the objective without smoothing,
///
///   f - F > 0.01 F as one of the first two holds, so that distortions of cells with p_i < 2 are at the level of rounding,
///     as with p = 1 and p = 10 side by side; or
///   -<g, d> / 2 > tolerance p f_k with a fresh metric and no decreasing step.
class QuasiNewton : public Minimiser {
 public:
  /// What it holds of each vertex: 4 states, gradients and directions, and in single precision 6 pairs of L-BFGS and one gradient.
  static constexpr std::size_t kBytesPerVertex = 4 * 3 * sizeof(double) + 13 * 3 * sizeof(float);

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
  bool is_smoothing_in_the_way() const;
  StepResult result(Outcome outcome);

  Problem problem_;
  std::vector<double> shares_;  // shares of the way from 2 to p_i, one per early stage
  double eps2_ = 0;             // smoothing
  int stage_ = 0;
  bool is_last_stage_ = false;
  LpNorm norm_;  // the stage's norm
  bool is_true_norm_ = false;
  Points x_, direction_;
  Points trial_;  // while step_length_ > 0, the gradient before that step
  Points gradient_;
  SinglePoints preconditioned_;  // M^-1 times a gradient, until memory_ takes it
  double last_length_ = 1;       // the last step's length
  double step_length_ = 0;       // of the last step along direction_, while its pair is not stored yet
  double objective_ = 0;
  double smoothing_sum_ = 0;  // part of objective_; if p is mixed, in the last stage
  double true_sum_ = 0;       // the sum of problem_.norm at x_
  LbfgsMemory memory_;
  const bool is_prepared_;      // x comes from a coarse level
  const bool keeps_metric_;     // Warmth::kWithMetric
  std::deque<double> history_;  // objectives of the stage's last 21 iterations
  int stage_iterations_ = 0, since_refresh_ = 0;
  bool is_metric_good_ = false;
};

}  // namespace lpdeform
