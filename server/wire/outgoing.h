#pragma once

#include <cstddef>
#include <optional>

#include "server/session/frame.h"

namespace lpdeform {

/// A message of a stream on its way to its reader. The numbers of a frame are not copied into it: they are sent from where the
/// frame's surface has them, to however many readers. frame_slices.h makes bytes of it.
template <typename Message>
struct Outgoing {
  Message message;                  // with a frame, all of its part but the numbers and their padding
  std::optional<FramePiece> piece;  // whose numbers those are

  void Clear() {
    message.Clear();
    piece.reset();
  }
  /// Of the whole, numbers included.
  std::size_t ByteSizeLong() const;
};

}  // namespace lpdeform
