#pragma once

#include "absl/status/status.h"
#include "core/energy/material.h"
#include "core/problem/handles.h"
#include "core/problem/settings.h"

namespace lpdeform {

/// INVALID_ARGUMENT: TOLERANCE_OUT_OF_RANGE, ITERATIONS_OUT_OF_RANGE, TIME_LIMIT_OUT_OF_RANGE; METHOD_NEEDS_P if the
/// method works for one p only and `material` has another.
absl::Status check_settings(const SolveSettings& settings, const Material& material);

/// INVALID_ARGUMENT: METHOD_NEEDS_EXACT_HANDLES if the method is conic and a handle does not hold vertices exactly;
/// names the handle.
absl::Status check_method_takes(Method method, const HandleSet& handles);

}  // namespace lpdeform
