#pragma once

#include <optional>
#include <stop_token>

#include "core/constraints/constraints.h"
#include "core/constraints/metric.h"
#include "core/energy/lp_norm.h"
#include "core/methods/objective.h"

namespace lpdeform {

/// The input of a method; it must outlive the method. Positions are in scaled units.
struct Problem {
  Objective& objective;
  Metric& metric;
  const Constraints& constraints;
  const LpNorm& norm;     // defines the objective to minimise
  double tolerance;       // SolveSettings::tolerance
  double length_unit;     // l in scaled units, for thresholds that the paper gives in absolute lengths
  double diagonal;        // of the rest mesh, in scaled units
  double zero_objective;  // an unsmoothed objective that is 0 to rounding
  double zero_squares;    // the sum of E_i^2 that is 0 to rounding
  std::stop_token stop;   // checked between evaluations

  const RestShape& shape() const { return objective.cells().shape(); }
  const Workers& workers() const { return objective.cells().workers(); }

  /// Whether the objective's last evaluation, with the unsmoothed sum `sum`, is 0 to rounding. If p is mixed, the
  /// rounding error of a cell with p_i = 1 exceeds large distortions of a cell with p_i = 24, so the E_i are checked as
  /// well.
  bool is_zero(double sum) const;

  /// Factors the metric for the weights of the objective's last evaluation, or with the given cell weights. With linear
  /// constraints always in double precision. False if that fails.
  [[nodiscard]] bool factor_metric(Metric::Precision precision) const {
    return factor_metric(objective.cells().cell_weights(), precision);
  }
  [[nodiscard]] bool factor_metric(const std::vector<double>& cell_weights,
                                   Metric::Precision precision) const;
  /// x = M^-1 b, restricted to the directions that the constraints allow, for any b. x may be b.
  void solve(const Points& b, Points& x) const;
  /// The same to single precision, several times as fast.
  void precondition(const Points& b, Points& x) const;
  void precondition(const Points& b, SinglePoints& x) const;
};

/// How an iteration went.
enum class Outcome {
  kProgress,
  kConverged,
  kStalled,
  kBreakdown,
};

struct StepResult {
  Outcome outcome = Outcome::kProgress;
  double objective = 0;  // the method's current objective at x()
  int stage = 0;         // number of the current objective; within a stage it never increases
  std::optional<double> true_sum = std::nullopt;  // problem.norm's sum at x(), if the method knows it
};

/// A solver method. Each call makes one iteration. The calling loop (Deformer::step) is responsible for time, limits,
/// cancellation, the trace and the best state.
class Minimiser {
 public:
  virtual ~Minimiser() = default;

  /// Makes one iteration. Afterwards problem.objective holds the evaluation at x(): its squared energies belong to x().
  virtual StepResult step() = 0;

  /// The current state: finite, and all constraints are satisfied.
  virtual const Points& x() const = 0;

  /// An intermediate state other than x(), if there is a new one since the last call: finite, and all constraints are
  /// satisfied. problem.objective then holds the evaluation there. Calling this does not change steps or their results. With
  /// `is_last` the answer depends on the steps alone, not on earlier calls or the time.
  virtual std::optional<Points> intermediate_state(bool /*is_last*/) { return std::nullopt; }

  /// What levels that end with the solve hold at present.
  virtual std::size_t level_bytes() const { return 0; }
};

/// Restricts `values`, a gradient or a direction, to what the constraints allow: rows of held vertices become zero, and
/// directions that linear constraints forbid are projected out.
void restrict_to_free(const Constraints& constraints, Points& values);

}  // namespace lpdeform
