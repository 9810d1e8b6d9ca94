#include "server/session/frame_pace.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace lpdeform {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using Kind = FramePace::Kind;
using TimePoint = Timers::TimePoint;

constexpr TimePoint kStart{hours(1)};
constexpr milliseconds kPeriod{100};

TimePoint at(int ms) {
  return kStart + milliseconds(ms);
}

TEST(FramePace, LetsEveryFrameBeginIfThereIsNoLimit) {
  FramePace pace(0);
  for (int k = 0; k < 3; ++k) {
    EXPECT_LE(pace.next_at(Kind::kRefinement), kStart);
    pace.begin(kStart);
  }
}

TEST(FramePace, LetsTheFirstFrameBeginAtOnce) {
  const FramePace pace(1e-9);
  EXPECT_LE(pace.next_at(Kind::kAnswer), kStart);
  EXPECT_LE(pace.next_at(Kind::kRefinement), kStart);
}

TEST(FramePace, KeepsRefinementsOnePeriodApart) {
  FramePace pace(10);
  for (int ms = 0; ms < 1000; ms += 100) {
    EXPECT_LE(pace.next_at(Kind::kRefinement), at(ms));
    pace.begin(at(ms));
    EXPECT_EQ(pace.next_at(Kind::kRefinement), at(ms + 100));
  }
}

TEST(FramePace, AnAnswerMayFollowARefinementAtOnceAndTheNextRefinementWaitsTwoPeriods) {
  FramePace pace(10);
  pace.begin(at(0));
  EXPECT_LE(pace.next_at(Kind::kAnswer), at(0));
  pace.begin(at(10));
  EXPECT_EQ(pace.next_at(Kind::kAnswer), at(100));
  EXPECT_EQ(pace.next_at(Kind::kRefinement), at(200));
}

TEST(FramePace, SavesUpNoMoreThanTwoFrames) {
  FramePace pace(10);
  pace.begin(at(0));
  pace.begin(at(60'000));
  EXPECT_LE(pace.next_at(Kind::kAnswer), at(60'000));
  pace.begin(at(60'000));
  EXPECT_EQ(pace.next_at(Kind::kAnswer), at(60'100));
}

TEST(FramePace, BeginsAtMostOneFrameMoreThanAFixedDistanceWouldInAnyTime) {
  std::mt19937 random(1);
  FramePace pace(10);
  std::vector<TimePoint> begun;
  TimePoint now = kStart;
  for (int k = 0; k < 2000; ++k) {
    const Kind kind = random() % 3 == 0 ? Kind::kRefinement : Kind::kAnswer;
    now = std::max(now + milliseconds(random() % 40), pace.next_at(kind));
    pace.begin(now);
    begun.push_back(now);
  }
  for (std::size_t i = 0; i < begun.size(); ++i) {
    for (std::size_t j = i; j < begun.size(); ++j) {
      const auto frames = static_cast<Timers::Duration::rep>(j - i + 1);
      ASSERT_LE(frames, (begun[j] - begun[i]) / kPeriod + 2) << i << " to " << j;
    }
  }
}

TEST(FramePace, AnswersAtHalfTheLimitNeverWaitHoweverMuchIsRefinedBetweenThem) {
  FramePace pace(60);
  int frames = 0;
  for (int k = 0; k < 3000; ++k) {  // 30 a second, at times that vary by 10 ms
    const TimePoint answer = kStart + milliseconds(100 * k / 3 + 7 * k % 11);
    while (pace.next_at(Kind::kRefinement) < answer && k > 0) {
      pace.begin(pace.next_at(Kind::kRefinement));
      ++frames;
    }
    ASSERT_LE(pace.next_at(Kind::kAnswer), answer) << "answer " << k;
    pace.begin(answer);
    ++frames;
  }
  EXPECT_LE(frames, 60 * 100 + 1);
  EXPECT_GE(frames, 60 * 99);
}

}  // namespace
}  // namespace lpdeform
