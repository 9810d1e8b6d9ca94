#include "client/cpp/recovery.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "client/cpp/lease.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {
namespace {

absl::Status ended_because(absl::StatusCode code, Reason reason, const v1::GoAway& go_away) {
  return make_fault(code, {reason, "", ""}, go_away.text());
}

/// What to do after a GoAway, and why the stream ended.
std::pair<NextStep, absl::Status> after_go_away(const v1::GoAway& go_away, bool has_copy) {
  switch (go_away.reason()) {
    case v1::GO_AWAY_REASON_SESSION_DELETED:
      return {NextStep::kGiveUp,
              ended_because(absl::StatusCode::kNotFound, Reason::kSessionDeleted, go_away)};
    case v1::GO_AWAY_REASON_SESSION_EXPIRED:
      return {has_copy ? NextStep::kRecreate : NextStep::kGiveUp,
              ended_because(absl::StatusCode::kNotFound, Reason::kSessionExpired, go_away)};
    case v1::GO_AWAY_REASON_WRITER_REPLACED:
      return {NextStep::kGiveUp, ended_because(absl::StatusCode::kAborted, Reason::kWriterReplaced, go_away)};
    case v1::GO_AWAY_REASON_PROTOCOL_ERROR:
      return {NextStep::kGiveUp, ended_because(absl::StatusCode::kInternal, Reason::kProtocolError, go_away)};
    case v1::GO_AWAY_REASON_TOKEN_EXPIRED:
      return {NextStep::kResume,
              ended_because(absl::StatusCode::kUnauthenticated, Reason::kTokenExpired, go_away)};
    default:
      return {NextStep::kResume, ended_because(absl::StatusCode::kUnavailable, Reason::kDraining, go_away)};
  }
}

bool is_passing(absl::StatusCode code) {
  switch (code) {
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

std::pair<NextStep, absl::Status> after_status(const absl::Status& ended, bool has_copy) {
  const std::string reason = fault_of(ended).reason;
  if (ended.ok()) return {NextStep::kResume, absl::UnavailableError("The server ended the stream.")};
  // The server has another mesh, or an exception occurred: a retry would fail again.
  if (reason == Reason::kFrameVertices || reason == Reason::kException) return {NextStep::kGiveUp, ended};
  if (is_session_lost(ended)) return {has_copy ? NextStep::kRecreate : NextStep::kGiveUp, ended};
  if (is_passing(ended.code()) || is_undecided(ended)) return {NextStep::kResume, ended};
  if (reason == Reason::kNotTheWriter) {  // another writer took over while we were disconnected
    return {NextStep::kGiveUp,
            make_fault({Reason::kWriterReplaced, "", ""}, "Another writer took the session over.")};
  }
  return {NextStep::kGiveUp, ended};
}

double by_chance() {
  thread_local std::minstd_rand chance{std::random_device{}()};
  return std::uniform_real_distribution<double>()(chance);
}

}  // namespace

std::chrono::milliseconds Backoff::next(std::chrono::milliseconds asked) {
  const double chance = chance_ ? chance_() : by_chance();
  const auto longest = static_cast<double>(longest_.count());
  longest_ = std::min(longest_ * 2, kMost);
  const std::chrono::milliseconds own(std::llround(longest * (0.5 + 0.5 * chance)));
  return std::clamp(asked, std::chrono::milliseconds(0), kMostAsked) + own;
}

Recovery RecoveryRules::with_pause(NextStep next, absl::Status why, std::chrono::milliseconds asked) {
  const auto obeyed = std::min(asked, Backoff::kMostAsked);
  return {next, std::move(why), obeyed, backoff_.next(asked)};
}

void RecoveryRules::begin() {
  misfits_ = 0;
  backoff_.reset();
}

Recovery RecoveryRules::after(const Ending& ending) {
  if (ending.stood >= Backoff::kMost) backoff_.reset();  // not after a stream that broke at once
  auto [next, why] =
      ending.go_away ? after_go_away(*ending.go_away, has_copy_) : after_status(ending.status, has_copy_);
  const bool is_misfit = fault_of(why).reason == Reason::kFrameParts && ++misfits_ >= kMostMisfits;
  if (is_misfit || ending.away > reconnect_for_) next = NextStep::kGiveUp;
  const auto asked = ending.go_away ? std::chrono::milliseconds(ending.go_away->reconnect_after_ms())
                                    : retry_after(ending.status);
  return with_pause(next, std::move(why), asked);
}

Recovery RecoveryRules::after_failed_making(const absl::Status& failed) {
  return with_pause(is_undecided(failed) ? NextStep::kRecreate : NextStep::kGiveUp, failed,
                    retry_after(failed));
}

Answer answer_of(const absl::Status& status, bool is_second) {
  if (is_session_lost(status)) return Answer::kRecreate;
  if (is_taken_all_the_same(status)) return Answer::kTaken;
  const bool is_hopeless = is_second && fault_of(status).reason == Reason::kUploadUnknown;
  return is_undecided(status) && !is_hopeless ? Answer::kAgain : Answer::kRefused;
}

}  // namespace lpdeform::client
