#include "core/problem/settings.h"

#include <array>

namespace lpdeform {
namespace {

constexpr std::array kMethods = {Method::kAuto,       Method::kQuasiNewton, Method::kMultiresolution,
                                 Method::kLineSearch, Method::kLocalGlobal, Method::kConic};

}  // namespace

std::string_view method_name(Method method) {
  switch (method) {
    case Method::kAuto:
      return "auto";
    case Method::kQuasiNewton:
      return "quasi_newton";
    case Method::kMultiresolution:
      return "multiresolution";
    case Method::kLineSearch:
      return "line_search";
    case Method::kLocalGlobal:
      return "local_global";
    case Method::kConic:
      return "conic";
  }
  return "unknown";
}

std::optional<Method> method_named(std::string_view name) {
  for (const Method method : kMethods) {
    if (method_name(method) == name) return method;
  }
  return std::nullopt;
}

std::string_view initial_guess_name(InitialGuess guess) {
  switch (guess) {
    case InitialGuess::kCurrent:
      return "current";
    case InitialGuess::kLaplacian:
      return "laplacian";
    case InitialGuess::kRest:
      return "rest";
  }
  return "unknown";
}

std::string_view stop_reason_name(StopReason reason) {
  switch (reason) {
    case StopReason::kRunning:
      return "running";
    case StopReason::kConverged:
      return "converged";
    case StopReason::kIterationLimit:
      return "iteration_limit";
    case StopReason::kTimeLimit:
      return "time_limit";
    case StopReason::kCancelled:
      return "cancelled";
    case StopReason::kStalled:
      return "stalled";
    case StopReason::kNumericalBreakdown:
      return "numerical_breakdown";
  }
  return "unknown";
}

}  // namespace lpdeform
