#include "client/cpp/recovery.h"

#include <algorithm>
#include <string>

#include "core/base/fault.h"

namespace lpdeform::client {
namespace {

absl::Status ended_because(absl::StatusCode code, const char* reason, const v1::GoAway& go_away) {
  return make_fault(code, {reason, "", ""}, go_away.text());
}

Recovery after_go_away(const v1::GoAway& go_away, bool has_copy) {
  const std::chrono::milliseconds pause(go_away.reconnect_after_ms());
  switch (go_away.reason()) {
    case v1::GO_AWAY_REASON_SESSION_DELETED:
      return {NextStep::kGiveUp, ended_because(absl::StatusCode::kNotFound, "SESSION_DELETED", go_away),
              pause};
    case v1::GO_AWAY_REASON_SESSION_EXPIRED:
      return {has_copy ? NextStep::kMakeAnew : NextStep::kGiveUp,
              ended_because(absl::StatusCode::kNotFound, "SESSION_EXPIRED", go_away), pause};
    case v1::GO_AWAY_REASON_WRITER_REPLACED:
      return {NextStep::kGiveUp, ended_because(absl::StatusCode::kAborted, "WRITER_REPLACED", go_away),
              pause};
    case v1::GO_AWAY_REASON_PROTOCOL_ERROR:
      return {NextStep::kGiveUp, ended_because(absl::StatusCode::kInternal, "PROTOCOL_ERROR", go_away),
              pause};
    default:
      return {NextStep::kResume, ended_because(absl::StatusCode::kUnavailable, "DRAINING", go_away), pause};
  }
}

bool is_passing(absl::StatusCode code) {
  switch (code) {
    case absl::StatusCode::kOk:  // the server ended the stream without a word
    case absl::StatusCode::kCancelled:
    case absl::StatusCode::kUnknown:
    case absl::StatusCode::kDeadlineExceeded:
    case absl::StatusCode::kResourceExhausted:
    case absl::StatusCode::kInternal:
    case absl::StatusCode::kUnavailable:
    case absl::StatusCode::kDataLoss:
      return true;
    default:
      return false;
  }
}

}  // namespace

Recovery recovery_after(const absl::Status& ended, const std::optional<v1::GoAway>& go_away, bool has_copy) {
  if (go_away) return after_go_away(*go_away, has_copy);
  if (fault_of(ended).reason == "FRAME_VERTICES")
    return {NextStep::kGiveUp, ended, {}};  // it is another mesh
  if (is_passing(ended.code())) return {NextStep::kResume, ended, {}};
  if (absl::IsNotFound(ended) && has_copy) return {NextStep::kMakeAnew, ended, {}};
  if (fault_of(ended).reason == "NOT_THE_WRITER") {  // it happened while we were away
    return {NextStep::kGiveUp,
            make_fault(absl::StatusCode::kAborted, {"WRITER_REPLACED", "", ""},
                       "Another writer took the session over."),
            {}};
  }
  return {NextStep::kGiveUp, ended, {}};
}

std::chrono::milliseconds Backoff::next() {
  std::uniform_int_distribution<std::int64_t> spread(longest_.count() / 2, longest_.count());
  longest_ = std::min(longest_ * 2, kMost);
  return std::chrono::milliseconds(spread(chance_));
}

}  // namespace lpdeform::client
