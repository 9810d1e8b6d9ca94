#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "absl/status/status.h"
#include "core/energy/rest_shape.h"
#include "core/problem/handle.h"

namespace lpdeform {

/// No position may be farther from the rest mesh's centre than this many of its diagonals.
inline constexpr double kFarthestTarget = 1e9;

/// Checks the targets of a handle, in the caller's units, one row for each of its vertices or points. INVALID_ARGUMENT:
/// HANDLE_TARGET_TOO_FAR (over kFarthestTarget diagonals from the centre); its text names the vertex or point. `first_copy`: the
/// caller's vertex for each of the shape's (Weld::first_copy); null if they are the same.
absl::Status check_targets(const RestShape& shape, std::string_view name, const Handle& handle,
                           const Points& targets, const std::vector<std::int32_t>* first_copy = nullptr);

/// Checks initial positions, in the caller's units, one row for each vertex. INVALID_ARGUMENT: POSITIONS_SIZE;
/// POSITIONS_NOT_FINITE (also over kFarthestTarget diagonals from the centre), which names the vertex.
absl::Status check_positions(const RestShape& shape, const Points& positions);

/// The same errors, for callers who find them before they have such positions.
absl::Status wrong_position_count(std::int64_t positions, std::int64_t vertices);
absl::Status position_too_far(std::int64_t vertex);

}  // namespace lpdeform
