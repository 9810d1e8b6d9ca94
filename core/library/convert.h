#pragma once

#include <vector>

#include "absl/status/statusor.h"
#include "core/library/result.h"
#include "core/library/types.h"
#include "core/mesh/mesh.h"
#include "core/problem/handles.h"
#include "core/problem/settings.h"

namespace lpdeform::core {

/// The public values as those of the rooms below. INVALID_ARGUMENT: MESH_SIZE, POSITIONS_SIZE, HANDLE_TARGET_COUNT
/// (numbers that are not three for each point), HANDLE_VERTEX_OUT_OF_RANGE, HANDLE_FACE_OUT_OF_RANGE.
absl::StatusOr<TriangleMesh> converted(const Mesh& mesh);
absl::StatusOr<lpdeform::Handle> converted(std::string_view name, const Handle& handle,
                                           const TriangleMesh& mesh);
absl::StatusOr<HandleMotion> converted(std::string_view name, const Motion& motion);
absl::StatusOr<Points> points_of(const std::vector<double>& numbers, std::int32_t vertex_count);
Field converted(const FieldValue& value);
SolveSettings converted(const SolveOptions& options);

/// The values of the rooms below as the public ones.
Error error_of(const absl::Status& status);
Result<void> result_of(const absl::Status& status);
Mesh given_back(const TriangleMesh& mesh);

std::vector<double> numbers_of(const auto& matrix) {
  return {matrix.data(), matrix.data() + matrix.size()};
}

}  // namespace lpdeform::core
