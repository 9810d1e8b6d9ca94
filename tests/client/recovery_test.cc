#include "client/cpp/recovery.h"

#include <gtest/gtest.h>

#include "core/base/fault.h"

namespace lpdeform::client {
namespace {

v1::GoAway go_away(v1::GoAwayReason reason) {
  v1::GoAway message;
  message.set_reason(reason);
  message.set_reconnect_after_ms(250);
  return message;
}

NextStep after(v1::GoAwayReason reason, bool has_copy = true) {
  return recovery_after(absl::OkStatus(), go_away(reason), has_copy).next;
}

NextStep after(const absl::Status& ended, bool has_copy = true) {
  return recovery_after(ended, std::nullopt, has_copy).next;
}

TEST(Recovery, ResumesWhereTheServerOrTheConnectionWentAway) {
  EXPECT_EQ(after(v1::GO_AWAY_REASON_DRAINING), NextStep::kResume);
  EXPECT_EQ(after(absl::UnavailableError("connection reset")), NextStep::kResume);
  EXPECT_EQ(after(absl::InternalError("RST_STREAM")), NextStep::kResume);
  EXPECT_EQ(after(absl::OkStatus()), NextStep::kResume);
}

TEST(Recovery, MakesALostSessionAnewWhereThereIsACopy) {
  EXPECT_EQ(after(absl::NotFoundError("no such session")), NextStep::kMakeAnew);
  EXPECT_EQ(after(v1::GO_AWAY_REASON_SESSION_EXPIRED), NextStep::kMakeAnew);
  EXPECT_EQ(after(absl::NotFoundError("no such session"), false), NextStep::kGiveUp);
  EXPECT_EQ(after(v1::GO_AWAY_REASON_SESSION_EXPIRED, false), NextStep::kGiveUp);
}

TEST(Recovery, GivesUpWhereSomebodyMeantIt) {
  EXPECT_EQ(after(v1::GO_AWAY_REASON_SESSION_DELETED), NextStep::kGiveUp);
  EXPECT_EQ(after(v1::GO_AWAY_REASON_WRITER_REPLACED), NextStep::kGiveUp);
  EXPECT_EQ(after(v1::GO_AWAY_REASON_PROTOCOL_ERROR), NextStep::kGiveUp);
  EXPECT_EQ(after(absl::UnauthenticatedError("no token")), NextStep::kGiveUp);
  EXPECT_EQ(after(absl::InvalidArgumentError("credit 9")), NextStep::kGiveUp);
}

TEST(Recovery, KeepsTheReasonAndThePauseOfAGoAway) {
  const Recovery recovery = recovery_after({}, go_away(v1::GO_AWAY_REASON_WRITER_REPLACED), true);
  EXPECT_EQ(fault_of(recovery.why).reason, "WRITER_REPLACED");
  EXPECT_TRUE(absl::IsAborted(recovery.why));
  EXPECT_EQ(recovery.pause, std::chrono::milliseconds(250));
}

TEST(Recovery, SaysThatAnotherWriterTookOverWhileTheConnectionWasDown) {
  const Recovery recovery =
      recovery_after(make_fault(absl::StatusCode::kPermissionDenied, {"NOT_THE_WRITER", "writer_token", ""},
                                "Not the writer."),
                     std::nullopt, true);
  EXPECT_EQ(recovery.next, NextStep::kGiveUp);
  EXPECT_EQ(fault_of(recovery.why).reason, "WRITER_REPLACED");
}

TEST(Backoff, GrowsFromFiftyMillisecondsToFiveSecondsAndStartsAgain) {
  Backoff backoff;
  EXPECT_LE(backoff.next(), std::chrono::milliseconds(50));
  for (int k = 0; k < 10; ++k) backoff.next();
  const auto longest = backoff.next();
  EXPECT_GE(longest, std::chrono::milliseconds(2500));
  EXPECT_LE(longest, std::chrono::milliseconds(5000));
  backoff.reset();
  EXPECT_LE(backoff.next(), std::chrono::milliseconds(50));
}

}  // namespace
}  // namespace lpdeform::client
