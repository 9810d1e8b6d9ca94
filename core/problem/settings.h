#pragma once

#include <limits>
#include <optional>
#include <string_view>

namespace lpdeform {

enum class Method {
  kAuto,  // kMultiresolution for cold solves of large meshes, else kQuasiNewton; cold with some p_i <= 1.2, from 300
          // up to 15,000 vertices, both, and the better result is kept
  kQuasiNewton,      // L-BFGS on E(x) in the metric of the prefactored, reweighted Laplacian. Every p.
  kMultiresolution,  // a coarse level first, then kQuasiNewton. Every p.
  kLineSearch,       // the paper's section 3.2: gradient descent with backtracking. Every p.
  kLocalGlobal,      // Sorkine & Alexa 2007. p = 2 only.
  kConic,  // the paper's section 3.3: second-order cone programs and rotation fits in turn. p = 1 only.
};

enum class InitialGuess {
  kCurrent,  // the Deformer's state moved on as the last handle move had moved it, where this one goes the
             // same way; the rest of the handles' displacement extended harmonically. Its first is kLaplacian
  kLaplacian,  // the naive Laplacian deformation, no rotations (section 4)
  kRest,       // the rest mesh, handles at their targets
};

enum class StopReason {
  kRunning,    // not stopped yet
  kConverged,  // the tolerance is met
  kIterationLimit,
  kTimeLimit,
  kCancelled,
  kStalled,             // no step lowers the energy, short of the tolerance
  kNumericalBreakdown,  // a factorisation failed or a number was not finite; the best state seen is kept
};

std::string_view method_name(Method method);  // "quasi_newton"
std::optional<Method> method_named(std::string_view name);
std::string_view initial_guess_name(InitialGuess guess);
std::string_view stop_reason_name(StopReason reason);  // "iteration_limit"

struct SolveSettings {
  Method method = Method::kAuto;
  InitialGuess initial = InitialGuess::kCurrent;

  /// Converged when the relative decrease that the method still expects is at most this; written out at each
  /// method in core/methods/*.h. In [1e-14, 0.1]. line_search and conic stop as the paper does and scale its
  /// thresholds by tolerance / kDefaultTolerance.
  double tolerance = kDefaultTolerance;
  int max_iterations = 100000;                                          // >= 0
  double time_limit_seconds = std::numeric_limits<double>::infinity();  // of solving, set-up aside, > 0

  /// Keep a record for each iteration (SolveSummary::trace). Off in live sessions.
  bool keep_trace = false;
  /// Compute the certificate at the end (SolveSummary::optimality_gap).
  bool certify = false;

  static constexpr double kDefaultTolerance = 1e-5;
};

}  // namespace lpdeform
