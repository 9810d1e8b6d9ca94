#pragma once

#include <array>

namespace lpdeform {

/// Why a stream of frames is over. Closed: these are all the reasons of `stream_ended` in the log and of
/// lpdeform_streams_ended_total. deploy/operating.md says what each means for an operator.
enum class StreamEnd {
  // The server ended it, and told the client (GoAway).
  kSessionDeleted,
  kSessionExpired,
  kSessionElsewhere,  // another server has the session now
  kDraining,          // this server shuts down
  kWriterReplaced,
  kMisuse,  // the client does not keep to the contract
  kTokenExpired,
  kRefused,  // with an error: the line `refused` before says why
  // It ended from outside. gRPC does not say whether the client took its call back or is gone.
  kDeadline,     // the client's own
  kReaderStuck,  // and for kStuckAfter before that the reader had taken nothing of what waited for it
  kCancelled
};

inline constexpr std::array kStreamEnds{
    StreamEnd::kSessionDeleted, StreamEnd::kSessionExpired, StreamEnd::kSessionElsewhere,
    StreamEnd::kDraining,       StreamEnd::kWriterReplaced, StreamEnd::kMisuse,
    StreamEnd::kTokenExpired,   StreamEnd::kRefused,        StreamEnd::kDeadline,
    StreamEnd::kReaderStuck,    StreamEnd::kCancelled};

/// "session_deleted", ..., as the log and the metrics have it.
const char* stream_end_name(StreamEnd end);

}  // namespace lpdeform
