#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/c/lpdeform.h"
#include "client/c/space.h"
#include "client/cpp/types.h"

namespace lpdeform::engine {

/// Reads an engine's buffers as a mesh in the server's coordinates. Errors: ARGUMENT_MISSING, BUFFER_TOO_SMALL,
/// FORMAT_UNKNOWN, INDEX_COUNT. The server checks indices and coordinates.
absl::StatusOr<client::Mesh> read_mesh(const lpdeform_mesh& mesh, const Space& space);
/// How the vertices of the mesh are welded.
client::Weld read_weld(const lpdeform_mesh& mesh);

/// INVALID_ARGUMENT BUFFER_TOO_SMALL if `count` elements of `size` bytes, `stride` apart (0: without gaps), starting at
/// `offset`, do not fit into `bytes`.
absl::Status check_extent(const std::string& name, std::size_t bytes, std::uint32_t offset,
                          std::uint32_t stride, std::uint32_t size, std::uint32_t count);

}  // namespace lpdeform::engine
