#pragma once

#include <limits>
#include <optional>
#include <string_view>

namespace lpdeform {

enum class Method {
  kAuto,             // kMultiresolution for cold solves of large meshes, otherwise kQuasiNewton
  kQuasiNewton,      // L-BFGS on E(x) in the metric of the prefactored, reweighted Laplacian. Every p.
  kMultiresolution,  // a coarse level first, then kQuasiNewton. Every p.
  kLineSearch,       // the paper's section 3.2: gradient descent with backtracking. Every p.
  kLocalGlobal,      // Sorkine & Alexa 2007. p = 2 only.
  kConic,  // the paper's section 3.3: alternates cone programs (SOCP) and rotation fits. p = 1 only.
};

enum class InitialGuess {
  /// Warm start: from the Deformer's state. If this handle move continues the last one, the surface goes on as it did then. If not, the
  /// displacement of the handles is extended harmonically. kLaplacian if there is no state yet.
  kCurrent,
  kLaplacian,  // the naive Laplacian deformation, no rotations (section 4)
  kRest,       // the rest mesh, handles at their targets
};

enum class StopReason {
  kRunning,    // not stopped yet
  kConverged,  // the tolerance is met
  kIterationLimit,
  kTimeLimit,
  kCancelled,
  kStalled,             // no step decreases the energy, but the tolerance is not met
  kNumericalBreakdown,  // a factorisation failed or a number was not finite; the best state so far is kept
};

std::string_view method_name(Method method);  // "quasi_newton"
std::optional<Method> method_named(std::string_view name);
std::string_view initial_guess_name(InitialGuess guess);
std::string_view stop_reason_name(StopReason reason);  // "iteration_limit"

/// What a live session does with a lower minimum that it has found while its result stands.
struct StandingSearch {
  bool shows = false;  // shows it; otherwise announces it. Not used by Deformer
  /// The share of the energy that a lower minimum must save to be better (Deformer::better_energy). 0 to 1.
  double least_share = 0.02;

  bool operator==(const StandingSearch&) const = default;
};

struct SolveSettings {
  Method method = Method::kAuto;
  InitialGuess initial = InitialGuess::kCurrent;

  /// The convergence tolerance: a solve has converged when the relative decrease that the method still expects is at
  /// most this. core/methods/*.h give the exact convergence criterion of each method. In [1e-14, 0.1]. line_search and
  /// conic use the paper's criteria, with thresholds scaled by tolerance / kDefaultTolerance.
  double tolerance = kDefaultTolerance;
  int max_iterations = 100000;                                          // >= 0
  double time_limit_seconds = std::numeric_limits<double>::infinity();  // of solving, without set-up; > 0

  /// How far to look for lower minima once the first one is found: the number of further starts (MinimaSearch) is 12 times
  /// this, 0 to kHighestEffort. 0 takes the first minimum. Not set: 1 for cold solves with kAuto if some p_i < 2, where there are
  /// many minima; otherwise 0. The search has what is left of the limits below, and a start takes up to two or three times as
  /// long as the first minimum. Meshes of fewer than 100 vertices are not searched. On meshes of over
  /// DeformerOptions::search_up_to vertices the coarse levels search, and only what is lower there is tried on the mesh, as one
  /// further start. The result depends on the effort, but not on the threads.
  std::optional<int> effort = {};
  StandingSearch standing = {};

  /// Whether to keep a record of each iteration (SolveSummary::trace). Off in live sessions.
  bool keep_trace = false;
  /// Whether to compute the certificate at the end (SolveSummary::optimality_gap).
  bool certify = false;

  static constexpr double kDefaultTolerance = 1e-5;
  static constexpr int kHighestEffort = 1000;
};

}  // namespace lpdeform
