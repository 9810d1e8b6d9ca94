#pragma once

#include <chrono>
#include <optional>

#include "server/runtime/stream_ends.h"
#include "server/session/frame_stream.h"

namespace lpdeform {

inline constexpr std::chrono::seconds kStuckAfter{10};

/// How the call ended that carried the stream.
struct CallEnd {
  bool is_refused = false;
  bool is_past_deadline = false;
  std::chrono::duration<double> unread{0};  // how long its reader has taken nothing of what waited for it
};

/// `by_server`: what the stream was ended with first, where it was. That counts even if the call was cut before it could be said.
StreamEnd stream_end_of(const std::optional<EndReason>& by_server, const CallEnd& call);

}  // namespace lpdeform
