// Waiting for the result of the newest change, against a real server in this process.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>
#include <vector>

#include "tests/client/c/session_fixture.h"

namespace lpdeform::engine {
namespace {

using CSettleTest = CSessionTest;

TEST_F(CSettleTest, GivesAResultAgainThatWasTaken) {
  open(strip_.mesh());
  hold("base", {0, 1});
  const std::uint64_t seq = hold("tip", {20, 21}, shift(0, 2, 0));
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_TRUE(eventually([&] {
    return lpdeform_poll(session_, &buffers, &frame_, &error_) == LPDEFORM_OK && frame_.is_final == 1 &&
           frame_.input_seq == seq;
  }));
  const std::vector<Point> polled = points;
  const std::uint64_t frame_seq = frame_.frame_seq;
  EXPECT_EQ(settle(22), polled);
  EXPECT_EQ(frame_.frame_seq, frame_seq);
  EXPECT_EQ(frame_.input_seq, seq);
}

TEST_F(CSettleTest, SaysThatAChangeIsRefusedHoweverSoonTheFrameBeforeItHasCome) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  settle(22);
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = buffers_of(points);
  lpdeform_settings settings{};
  settings.struct_size = sizeof settings;
  settings.length_unit = std::nan("");
  for (int k = 0; k < 300; ++k) {
    const lpdeform_motion up = shift(0, 1 + k % 2, 0);
    ASSERT_EQ(lpdeform_move_handle(session_, "tip", &up, nullptr, &error_), LPDEFORM_OK);
    std::this_thread::sleep_for(std::chrono::microseconds(10 * k));
    ASSERT_EQ(lpdeform_set(session_, &settings, nullptr, &error_), LPDEFORM_OK);
    ASSERT_EQ(lpdeform_settle(session_, kPatienceSeconds, &buffers, &frame_, &error_),
              LPDEFORM_INVALID_ARGUMENT)
        << "round " << k;
    EXPECT_STREQ(error_.reason, "LENGTH_UNIT_OUT_OF_RANGE");
  }
}

}  // namespace
}  // namespace lpdeform::engine
