#pragma once

#include <string_view>

#include "absl/status/status.h"
#include "core/problem/handle.h"

namespace lpdeform {

/// FAILED_PRECONDITION NO_HANDLES, for what needs a handle where there is none.
absl::Status no_handles();

/// Checks a handle by itself. INVALID_ARGUMENT: HANDLE_NAME, HANDLE_EMPTY, HANDLE_POINTS_AND_VERTICES,
/// HANDLE_KIND_NEEDS_VERTICES, HANDLE_BARYCENTRIC, HANDLE_WEIGHT_OUT_OF_RANGE, HANDLE_LOCK_DIRECTION,
/// HANDLE_FOOTPRINT_OUT_OF_RANGE, and the reasons of check_motion.
absl::Status check_handle(std::string_view name, const Handle& handle);

/// Checks that this handle may have this motion. INVALID_ARGUMENT: HANDLE_MOTION_NOT_FINITE, HANDLE_AXIS_ZERO,
/// HANDLE_TARGET_COUNT, HANDLE_KIND_NEEDS_ROTATION (an orientation handle takes no positions).
absl::Status check_motion(std::string_view name, const Handle& handle, const HandleMotion& motion);

}  // namespace lpdeform
