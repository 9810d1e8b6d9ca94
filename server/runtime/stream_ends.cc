#include "server/runtime/stream_ends.h"

namespace lpdeform {

const char* stream_end_name(StreamEnd end) {
  switch (end) {
    case StreamEnd::kSessionDeleted:
      return "session_deleted";
    case StreamEnd::kSessionExpired:
      return "session_expired";
    case StreamEnd::kSessionElsewhere:
      return "session_elsewhere";
    case StreamEnd::kDraining:
      return "draining";
    case StreamEnd::kWriterReplaced:
      return "writer_replaced";
    case StreamEnd::kMisuse:
      return "misuse";
    case StreamEnd::kTokenExpired:
      return "token_expired";
    case StreamEnd::kRefused:
      return "refused";
    case StreamEnd::kDeadline:
      return "deadline";
    case StreamEnd::kReaderStuck:
      return "reader_stuck";
    case StreamEnd::kCancelled:
      return "cancelled";
  }
  return "";
}

}  // namespace lpdeform
