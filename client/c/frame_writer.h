#pragma once

#include <cstdint>

#include "absl/status/status.h"
#include "client/c/lpdeform.h"
#include "client/c/space.h"
#include "client/cpp/types.h"

namespace lpdeform::engine {

/// What every frame of a session has.
struct FrameContents {
  bool normals = false;
  bool distortion = true;
};

/// Whether frames of `vertex_count` vertices can be written there. INVALID_ARGUMENT BUFFER_TOO_SMALL, STRIDE_TOO_SMALL,
/// FORMAT_UNKNOWN, RED_OUT_OF_RANGE; FAILED_PRECONDITION NO_NORMALS, NO_DISTORTION.
absl::Status check_buffers(const lpdeform_buffers& buffers, std::uint32_t vertex_count,
                           const FrameContents& contents);

/// Writes the frame into buffers that check_buffers found right, in the engine's coordinates; returns what is
/// to be known of it. A direct pass over the vertices for each attribute, without memory of its own but for
/// the percentile of colours.
lpdeform_frame write_frame(const client::Frame& frame, const Space& space, const lpdeform_buffers& buffers);

}  // namespace lpdeform::engine
