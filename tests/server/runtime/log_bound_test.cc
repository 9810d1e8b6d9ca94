#include "server/runtime/log_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <string>

#include "server/runtime/log.h"

namespace lpdeform {
namespace {

LogBound::Kind refused(const std::string& session, const std::string& reason = "HANDLE_EMPTY") {
  return {2, "refused", reason, session};
}

/// Lines that are admitted of so many.
std::size_t admitted(LogBound& bound, const LogBound::Kind& kind, std::size_t many) {
  std::size_t written = 0;
  for (std::size_t k = 0; k < many; ++k) written += bound.admits(kind) ? 1 : 0;
  return written;
}

TEST(LogBound, TakesSoManyLinesOfASessionAndAReasonAndCountsTheRest) {
  LogBound bound;
  EXPECT_EQ(admitted(bound, refused("a"), 10'000), LogBound::kOfASession);
  EXPECT_EQ(admitted(bound, refused("b"), 3), 3u);
  EXPECT_EQ(admitted(bound, refused("a", "HANDLE_UNKNOWN"), 3), 3u);
  const auto left_out = bound.take();
  ASSERT_EQ(left_out.size(), 1u);
  EXPECT_EQ(left_out[0].count, 10'000 - LogBound::kOfASession);
  EXPECT_EQ(left_out[0].kind.event, "refused");
  EXPECT_EQ(left_out[0].kind.reason, "HANDLE_EMPTY");
  EXPECT_EQ(left_out[0].kind.session, "a");
  EXPECT_EQ(left_out[0].kind.level, 2);
}

TEST(LogBound, AfterItIsSummedUpLinesAreTakenAgain) {
  LogBound bound;
  admitted(bound, refused("a"), 100);
  EXPECT_EQ(bound.take().size(), 1u);
  EXPECT_TRUE(bound.take().empty());
  EXPECT_TRUE(bound.admits(refused("a")));
}

TEST(LogBound, ManySessionsTakeNoMoreThanAReasonHasAndNoneIsLostFromTheCount) {
  LogBound bound;
  std::size_t written = 0;
  for (int k = 0; k < 5000; ++k) written += admitted(bound, refused(std::to_string(k)), 2);
  EXPECT_EQ(written, LogBound::kOfAReason);
  std::uint64_t left_out = 0;
  const auto all = bound.take();
  for (const auto& [kind, count] : all) left_out += count;
  EXPECT_EQ(written + left_out, 10'000u);
  EXPECT_LE(all.size(), LogBound::kOfAReason + 1);
  EXPECT_EQ(all.back().kind.session, "");
}

TEST(Log, OneLineForEachOfManyThingsIsWrittenHoweverManyTheseAre) {
  constexpr std::uint64_t kMany = 20'000;  // more than its queue has
  testing::internal::CaptureStderr();
  {
    const Log log("info");
    for (std::uint64_t k = 0; k < kMany; ++k) log.error_each("one_of_many", {{"number", k}});
    log.error("last", {});
    log.end();
    log.error("too_late", {});
    log.sum_up();
  }
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), kMany + 1);
  EXPECT_EQ(said.find("lines_lost"), std::string::npos);
  EXPECT_NE(said.find("\"last\""), std::string::npos);
  EXPECT_EQ(said.find("too_late"), std::string::npos);
}

}  // namespace
}  // namespace lpdeform
