#pragma once

#include <optional>
#include <vector>

#include "core/base/geometry.h"
#include "core/problem/settings.h"

namespace lpdeform {

/// The record of one iteration. Within a stage the objective that is minimised (smoothed, or with rotations held) never
/// increases.
struct IterationRecord {
  int iteration = 0;     // 0 is the initial guess
  double seconds = 0;    // since the start of the solve, including the initial guess
  double energy = 0;     // true energy: Eq. 3 and soft terms, in the caller's units
  double objective = 0;  // what the method minimises, in its own units
  int stage = 0;         // counts from 0; a new stage is a new objective
};

/// The result of a solve. Energies are true energies, in the caller's units.
struct SolveSummary {
  Method method = Method::kAuto;  // the method that ran; never kAuto after a start
  StopReason stop_reason = StopReason::kRunning;
  int iterations = 0;
  double initial_energy = 0;
  /// Of the returned state, the lowest so far; includes the soft terms, which are minimised as well.
  double energy = 0;
  double soft_energy = 0;  // the part of the soft terms in `energy`; the rest is Eq. 3
  /// The relative duality gap (E - lower bound) / E of the convex problem with the rotations fitted at the result. It
  /// bounds how far the result can be from the optimum for these rotations. 0 if E is 0 to rounding. Empty if not
  /// requested.
  std::optional<double> optimality_gap;
  /// True energies of minima, in order: the first one, then one for each start of the search for lower ones
  /// (SolveSettings::effort) that has converged, or has come back to the lowest minimum, whose energy it then has. Several starts may come
  /// to the same minimum. `energy` is the lowest. Empty if a limit has ended the solve before the first.
  std::vector<double> minima;
  /// The further starts of the search. Those that were given up, because they were more than 2 % above the lowest minimum after a rough
  /// solve or did not come nearer to it, have no entry in `minima`.
  int further_starts = 0;
  int search_iterations = 0;  // the part of `iterations` that the search made
  int effort = 0;             // SolveSettings::effort, or its default
  double setup_seconds = 0;   // factorisation for these handles; 0 if it was reused
  double solve_seconds = 0;
  int threads = 1;
  // The work of the fine level: evaluations of all cells with fitted rotations, back-substitutions for three right-hand
  // sides, and numeric factorisations.
  int evaluations = 0;
  int back_substitutions = 0;
  int factorisations = 0;
  std::vector<IterationRecord> trace;
};

/// The distribution of cell energies that the report shows (Fig. 2).
struct DistortionStatistics {
  double min = 0, mean = 0, max = 0, median = 0;
  /// The sum of the largest ceil(n / 20) E_i divided by the sum of all; 0 if all are 0.
  double top_5_percent_share = 0;
  std::vector<double> edges;  // bins + 1 values, from 0 to max
  std::vector<std::int64_t> counts;
};

DistortionStatistics distortion_statistics(const Field& cell_energies, int bins = 40);

}  // namespace lpdeform
