#pragma once

#include <cstddef>
#include <optional>

#include "server/session/frame.h"

namespace lpdeform {

/// A message of a stream on its way to its reader. The numbers of a frame are not copied into it: they are
/// sent from the frame's surface, to any number of readers. frame_slices.h serializes it.
template <typename Message>
struct Outgoing {
  Message message;                  // for a frame, its part without the numbers and their padding
  std::optional<FramePiece> piece;  // the piece that has those numbers

  void Clear() {
    message.Clear();
    piece.reset();
  }
  /// Size of the whole message, numbers included.
  std::size_t ByteSizeLong() const;
};

}  // namespace lpdeform
