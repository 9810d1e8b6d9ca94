#include "core/problem/check_settings.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/problem/handle_name.h"

namespace lpdeform {
namespace {

absl::Status out_of_range(Reason reason, const std::string& name, double value, const std::string& limit) {
  return make_fault({reason, name, limit},
                    absl::StrCat(name, " is ", exact(value), "; it must satisfy ", limit));
}

absl::Status check_limits(const SolveSettings& settings) {
  if (!(settings.tolerance >= 1e-14 && settings.tolerance <= 0.1)) {
    return out_of_range(Reason::kToleranceOutOfRange, "tolerance", settings.tolerance,
                        "1e-14 <= tolerance <= 0.1");
  }
  if (settings.max_iterations < 0) {
    return out_of_range(Reason::kIterationsOutOfRange, "max_iterations", settings.max_iterations,
                        "0 <= max_iterations");
  }
  if (!(settings.time_limit_seconds > 0)) {
    return out_of_range(Reason::kTimeLimitOutOfRange, "time_limit_seconds", settings.time_limit_seconds,
                        "0 < time_limit_seconds");
  }
  const int effort = settings.effort.value_or(0);
  if (effort < 0 || effort > SolveSettings::kHighestEffort) {
    return out_of_range(Reason::kEffortOutOfRange, "effort", effort,
                        absl::StrCat("0 <= effort <= ", SolveSettings::kHighestEffort));
  }
  const double share = settings.standing.least_share;
  if (!(share >= 0 && share <= 1)) {
    return out_of_range(Reason::kLeastShareOutOfRange, "least_share", share, "0 <= least_share <= 1");
  }
  return absl::OkStatus();
}

absl::Status check_method(Method method, const Material& material) {
  const double lowest = material.p.minCoeff(), highest = material.p.maxCoeff();
  const double needed = method == Method::kLocalGlobal ? 2 : method == Method::kConic ? 1 : 0;
  if (needed == 0 || (lowest == needed && highest == needed)) return absl::OkStatus();
  const std::string limit = absl::StrCat("p = ", needed);
  const std::string name(method_name(method));
  return make_fault({Reason::kMethodNeedsP, name, limit},
                    absl::StrCat("method ", name, " needs ", limit, " everywhere; p is ", lowest,
                                 lowest == highest ? "" : absl::StrCat(" to ", highest)));
}

}  // namespace

absl::Status check_method_takes(Method method, const HandleSet& handles) {
  if (method != Method::kConic) return absl::OkStatus();
  for (const auto& [name, handle] : handles.handles()) {
    if (handle.fixes_vertices()) continue;
    const std::string limit = "handles that hold vertices exactly";
    return make_fault({Reason::kMethodNeedsExactHandles, handle_element(name), limit},
                      absl::StrCat("method ", std::string(method_name(method)), " takes ", limit, "; ",
                                   handle_element(name), " is held in another way"));
  }
  return absl::OkStatus();
}

absl::Status check_settings(const SolveSettings& settings, const Material& material) {
  absl::Status status = check_limits(settings);
  return status.ok() ? check_method(settings.method, material) : status;
}

}  // namespace lpdeform
