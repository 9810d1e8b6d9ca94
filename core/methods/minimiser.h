#pragma once

#include <optional>
#include <stop_token>

#include "core/constraints/constraints.h"
#include "core/constraints/metric.h"
#include "core/energy/lp_norm.h"
#include "core/methods/objective.h"

namespace lpdeform {

/// What a method works on; it outlives the method. Positions are in scaled units.
struct Problem {
  Objective& objective;
  Metric& metric;
  const Constraints& constraints;
  const LpNorm& norm;     // what is to be minimised
  double tolerance;       // SolveSettings::tolerance
  double length_unit;     // l in scaled units, for thresholds that the paper gives in absolute lengths
  double diagonal;        // of the rest mesh, in scaled units
  double zero_objective;  // an unsmoothed objective that is 0 to rounding
  double zero_squares;    // the sum of E_i^2 that is 0 to rounding
  std::stop_token stop;   // looked at between evaluations

  const RestShape& shape() const { return objective.cells().shape(); }
  const Workers& workers() const { return objective.cells().workers(); }

  /// Whether the objective's last evaluation, of the unsmoothed sum `sum`, is 0 to rounding. Where p is mixed, what rounding
  /// leaves of a cell with p_i = 1 is more than whole distortions of one with p_i = 24, so that E_i are looked at as well.
  bool is_zero(double sum) const;

  /// Factors the metric for the weights of the objective's last evaluation, or for others of the cells; with linear
  /// constraints always in double precision. False where that fails.
  [[nodiscard]] bool factor_metric(Metric::Precision precision) const {
    return factor_metric(objective.cells().cell_weights(), precision);
  }
  [[nodiscard]] bool factor_metric(const std::vector<double>& cell_weights,
                                   Metric::Precision precision) const;
  /// x = M^-1 b within what the constraints allow: a direction that they allow, for any b. x may be b.
  void solve(const Points& b, Points& x) const;
  /// The same to single precision, several times as fast.
  void precondition(const Points& b, Points& x) const;
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
  double objective = 0;  // at x(), of the method's present objective
  int stage = 0;         // counts the objectives; within a stage the objective never rises
  std::optional<double> true_sum = std::nullopt;  // problem.norm's sum at x(), where the method knows it
};

/// One algorithm: makes one iteration a call. Time, limits, cancellation, trace and the best state belong to
/// the loop that calls it (Deformer::step).
class Minimiser {
 public:
  virtual ~Minimiser() = default;

  /// One iteration. Afterwards problem.objective holds the evaluation at x() (its squared energies belong to
  /// x()).
  virtual StepResult step() = 0;

  /// The present state: finite, all constraints met.
  virtual const Points& x() const = 0;

  /// What the method has in hand beside x(), new since it was last asked: finite, all constraints met. problem.objective
  /// then holds the evaluation there. Steps and their results are the same with and without being asked.
  virtual std::optional<Points> in_hand() { return std::nullopt; }

  /// How the solve stands where it is ended by a limit now: none where it is not over in any sense.
  virtual std::optional<Outcome> outcome_before() const { return std::nullopt; }
  /// Whether the best state seen is of the method that is at work, so that the metric goes with it.
  virtual bool is_best_present() const { return true; }
};

/// Leaves of `values`, a gradient or a direction, what the constraints allow: rows of held vertices become
/// zero, and what linear constraints forbid is projected out.
void restrict_to_free(const Constraints& constraints, Points& values);

}  // namespace lpdeform
