#pragma once

#include <optional>
#include <vector>

#include "core/base/geometry.h"
#include "core/problem/settings.h"

namespace lpdeform {

/// One iteration. Within a stage the objective (what is being minimised: smoothed, or with rotations held)
/// never rises.
struct IterationRecord {
  int iteration = 0;     // 0 is the initial guess
  double seconds = 0;    // from the start of the solve, initial guess included
  double energy = 0;     // the true one, Eq. 3 and soft terms, in the caller's units
  double objective = 0;  // what the method minimises, in its own units
  int stage = 0;         // counts from 0; a new stage is a new objective
};

/// How a solve went. Energies are true ones, in the caller's units.
struct SolveSummary {
  Method method = Method::kAuto;  // what ran, never kAuto after a start
  StopReason stop_reason = StopReason::kRunning;
  int iterations = 0;
  double initial_energy = 0;
  double energy =
      0;  // of the state returned: the lowest seen; with the soft terms, which are minimised as well
  double soft_energy = 0;  // their part of it: the rest is Eq. 3
  /// (E - lower bound) / E of the convex step with the rotations fitted at the result: how far the answer can
  /// be at most from the best one for these rotations. 0 where E is 0 to rounding. Empty where it was not
  /// asked for.
  std::optional<double> optimality_gap;
  double setup_seconds = 0;  // factoring for this handle set; 0 where it was reused
  double solve_seconds = 0;
  int threads = 1;
  // The work of the fine level: evaluations of all cells, rotations fitted; back-substitutions for three right-hand sides.
  int evaluations = 0;
  int back_substitutions = 0;
  std::vector<IterationRecord> trace;
};

/// The distribution of cell energies that the report shows (Fig. 2).
struct DistortionStatistics {
  double min = 0, mean = 0, max = 0, median = 0;
  /// Sum of the largest ceil(n / 20) E_i over the sum of all; 0 where all are 0.
  double top_5_percent_share = 0;
  std::vector<double> edges;  // bins + 1 values, from 0 to max
  std::vector<std::int64_t> counts;
};

DistortionStatistics distortion_statistics(const Field& cell_energies, int bins = 40);

}  // namespace lpdeform
