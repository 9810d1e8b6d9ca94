#pragma once

#include <chrono>
#include <optional>

#include "server/runtime/stream_ends.h"
#include "server/session/frame_stream.h"

namespace lpdeform {

inline constexpr std::chrono::seconds kStuckAfter{10};

/// How the call that carried the stream ended.
struct CallEnd {
  bool is_refused = false;
  bool is_past_deadline = false;
  std::chrono::duration<double> unread{0};  // how long the reader has taken nothing of what waited for it
};

/// `by_server`: the first reason for which the server ended the stream, if it did. It counts even if the call
/// was cut before the client could be told.
StreamEnd stream_end_of(const std::optional<EndReason>& by_server, const CallEnd& call);

}  // namespace lpdeform
