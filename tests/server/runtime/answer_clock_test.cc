#include "server/runtime/answer_clock.h"

#include <gtest/gtest.h>

#include <vector>

namespace lpdeform {
namespace {

using std::chrono::milliseconds;

class AnswerClockTest : public testing::Test {
 protected:
  static AnswerClock::TimePoint at(int ms) { return AnswerClock::TimePoint(milliseconds(ms)); }
  std::vector<double> answered(std::uint64_t seq, int ms) {
    std::vector<double> waits;
    clock_.answered(seq, at(ms), [&](double seconds) { waits.push_back(seconds); });
    return waits;
  }
  AnswerClock clock_;
};

TEST_F(AnswerClockTest, AFrameAnswersEveryUpdateUpToIts) {
  clock_.took(1, at(0));
  clock_.took(2, at(250));
  clock_.took(5, at(500));
  EXPECT_EQ(answered(3, 1000), (std::vector<double>{1.0, 0.75}));
  EXPECT_EQ(answered(3, 2000), std::vector<double>());
  EXPECT_EQ(answered(9, 1500), std::vector<double>{1.0});
}

TEST_F(AnswerClockTest, AnUpdateThatCameLateDoesNotCount) {
  clock_.took(7, at(0));
  clock_.took(3, at(500));
  EXPECT_EQ(answered(7, 1000), std::vector<double>{1.0});
}

TEST_F(AnswerClockTest, EachUpdateIsBegunOnceAndStillWaitsForItsFrame) {
  const auto begun = [this](std::uint64_t seq, int ms) {
    std::vector<double> waits;
    clock_.begun(seq, at(ms), [&](double seconds) { waits.push_back(seconds); });
    return waits;
  };
  clock_.took(1, at(0));
  clock_.took(2, at(250));
  EXPECT_EQ(begun(1, 500), std::vector<double>{0.5});
  EXPECT_EQ(begun(2, 1000), std::vector<double>{0.75});
  EXPECT_EQ(begun(2, 2000), std::vector<double>());
  EXPECT_EQ(answered(2, 1250), (std::vector<double>{1.25, 1.0}));
}

TEST_F(AnswerClockTest, ForgetsAndIsBounded) {
  clock_.took(1, at(0));
  clock_.forget();
  EXPECT_EQ(answered(1, 10), std::vector<double>());
  for (std::uint64_t seq = 1; seq <= 2 * AnswerClock::kMostWaiting; ++seq) clock_.took(seq, at(0));
  EXPECT_EQ(answered(2 * AnswerClock::kMostWaiting, 10).size(), AnswerClock::kMostWaiting);
}

}  // namespace
}  // namespace lpdeform
