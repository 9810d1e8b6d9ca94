#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/c/lpdeform.h"
#include "client/c/space.h"
#include "client/cpp/types.h"

namespace lpdeform::engine {

/// What an engine's buffers say, as a mesh in the server's coordinates. Errors: ARGUMENT_MISSING, BUFFER_TOO_SMALL,
/// FORMAT_UNKNOWN, INDEX_COUNT. Indices and coordinates are the server's to check.
absl::StatusOr<client::Mesh> read_mesh(const lpdeform_mesh& mesh, const Space& space);
/// How its vertices are welded.
client::Weld read_weld(const lpdeform_mesh& mesh);

/// INVALID_ARGUMENT BUFFER_TOO_SMALL where `count` elements of `size` bytes, `stride` apart (0: without gaps) from
/// `offset` on do not lie within `bytes`.
absl::Status check_extent(const std::string& name, std::size_t bytes, std::uint32_t offset,
                          std::uint32_t stride, std::uint32_t size, std::uint32_t count);

}  // namespace lpdeform::engine
