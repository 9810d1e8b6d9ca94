#include "server/session/stream_end.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

namespace lpdeform {
namespace {

using std::chrono::seconds;

TEST(StreamEnd, EachHasANameOfItsOwn) {
  std::set<std::string> names;
  for (const StreamEnd end : kStreamEnds) names.insert(stream_end_name(end));
  EXPECT_EQ(names.size(), kStreamEnds.size());
  EXPECT_FALSE(names.contains(""));
}

TEST(StreamEnd, WhatTheServerEndedItForCountsBeforeHowTheCallEnded) {
  const CallEnd cut{true, true, seconds(100)};
  EXPECT_EQ(stream_end_of(EndReason::kSessionDeleted, cut), StreamEnd::kSessionDeleted);
  EXPECT_EQ(stream_end_of(EndReason::kSessionExpired, cut), StreamEnd::kSessionExpired);
  EXPECT_EQ(stream_end_of(EndReason::kDraining, cut), StreamEnd::kDraining);
  EXPECT_EQ(stream_end_of(EndReason::kElsewhere, cut), StreamEnd::kSessionElsewhere);
  EXPECT_EQ(stream_end_of(EndReason::kWriterReplaced, cut), StreamEnd::kWriterReplaced);
  EXPECT_EQ(stream_end_of(EndReason::kProtocolError, cut), StreamEnd::kMisuse);
  EXPECT_EQ(stream_end_of(EndReason::kTokenExpired, cut), StreamEnd::kTokenExpired);
}

TEST(StreamEnd, OfACallThatEndedFromOutsideTheDeadlineCountsBeforeAReaderThatTookNothing) {
  EXPECT_EQ(stream_end_of({}, {true, true, seconds(100)}), StreamEnd::kRefused);
  EXPECT_EQ(stream_end_of({}, {false, true, seconds(100)}), StreamEnd::kDeadline);
  EXPECT_EQ(stream_end_of({}, {false, false, kStuckAfter}), StreamEnd::kReaderStuck);
  EXPECT_EQ(stream_end_of({}, {false, false, seconds(9)}), StreamEnd::kCancelled);
}

}  // namespace
}  // namespace lpdeform
