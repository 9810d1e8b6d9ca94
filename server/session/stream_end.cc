#include "server/session/stream_end.h"

namespace lpdeform {
namespace {

StreamEnd end_of(EndReason reason) {
  switch (reason) {
    case EndReason::kSessionDeleted:
      return StreamEnd::kSessionDeleted;
    case EndReason::kSessionExpired:
      return StreamEnd::kSessionExpired;
    case EndReason::kElsewhere:
      return StreamEnd::kSessionElsewhere;
    case EndReason::kDraining:
      return StreamEnd::kDraining;
    case EndReason::kWriterReplaced:
      return StreamEnd::kWriterReplaced;
    case EndReason::kProtocolError:
      return StreamEnd::kMisuse;
    case EndReason::kTokenExpired:
      return StreamEnd::kTokenExpired;
  }
  return StreamEnd::kCancelled;
}

}  // namespace

StreamEnd stream_end_of(const std::optional<EndReason>& by_server, const CallEnd& call) {
  if (by_server) return end_of(*by_server);
  if (call.is_refused) return StreamEnd::kRefused;
  if (call.is_past_deadline) return StreamEnd::kDeadline;
  return call.unread >= kStuckAfter ? StreamEnd::kReaderStuck : StreamEnd::kCancelled;
}

}  // namespace lpdeform
