#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "client/c/lpdeform.h"
#include "client/c/space.h"
#include "client/cpp/types.h"

namespace lpdeform::engine {

/// What every frame of a session contains.
struct FrameContents {
  bool normals = false;
  bool distortion = true;
};

/// Checks that frames of `vertex_count` vertices can be written to `buffers`. INVALID_ARGUMENT BUFFER_TOO_SMALL,
/// STRIDE_TOO_SMALL, FORMAT_UNKNOWN, RED_OUT_OF_RANGE; FAILED_PRECONDITION NO_NORMALS, NO_DISTORTION.
absl::Status check_buffers(const lpdeform_buffers& buffers, std::uint32_t vertex_count,
                           const FrameContents& contents);

/// Writes the frame, in the engine's coordinates, into buffers that check_buffers has accepted; returns its
/// description. One pass over the vertices for each attribute. Allocates no memory, except for the percentile of
/// colours.
lpdeform_frame write_frame(const client::Frame& frame, const Space& space, const lpdeform_buffers& buffers);

}  // namespace lpdeform::engine
