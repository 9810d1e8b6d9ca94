#pragma once

#include <array>

namespace lpdeform {

/// Why a stream of frames ended. The set is closed: these are all reasons of `stream_ended` in the log and of
/// lpdeform_streams_ended_total. deploy/operating/streams.md says what each means for an operator.
enum class StreamEnd {
  // The server ended the stream and told the client (GoAway).
  kSessionDeleted,
  kSessionExpired,
  kSessionElsewhere,  // another server has the session now
  kDraining,          // this server shuts down
  kWriterReplaced,
  kMisuse,  // the client violates the protocol
  kTokenExpired,
  kRefused,  // with an error, which the line `refused` before gives
  // The stream ended from outside. gRPC does not say whether the client cancelled the call or is gone.
  kDeadline,     // the client's deadline passed
  kReaderStuck,  // the same, and the reader had taken nothing of what waited for it for kStuckAfter
  kCancelled
};

inline constexpr std::array kStreamEnds{
    StreamEnd::kSessionDeleted, StreamEnd::kSessionExpired, StreamEnd::kSessionElsewhere,
    StreamEnd::kDraining,       StreamEnd::kWriterReplaced, StreamEnd::kMisuse,
    StreamEnd::kTokenExpired,   StreamEnd::kRefused,        StreamEnd::kDeadline,
    StreamEnd::kReaderStuck,    StreamEnd::kCancelled};

/// "session_deleted" and so on, as in the log and the metrics.
const char* stream_end_name(StreamEnd end);

}  // namespace lpdeform
