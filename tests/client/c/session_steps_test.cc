// Steps of the handles taken back, resizing, and several threads that ask for frames, against a real server in this process.

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <thread>
#include <vector>

#include "tests/client/c/session_fixture.h"

namespace lpdeform::engine {
namespace {

class CStepsTest : public CSessionTest {
 protected:
  std::uint64_t lift(double height, bool begins_step = false) {
    const lpdeform_move move{"tip", shift(0, height, 0)};
    lpdeform_update update{};
    update.struct_size = sizeof update;
    update.moves = &move;
    update.move_count = 1;
    update.begins_step = begins_step;
    std::uint64_t seq = 0;
    EXPECT_EQ(lpdeform_send(session_, &update, &seq, &error_), LPDEFORM_OK) << error_.message;
    return seq;
  }

  float height() { return settle(22)[20][1]; }

  /// Between the smallest and the largest coordinate `axis`.
  static double extent(const std::vector<Point>& points, std::size_t axis) {
    const auto [least, most] = std::ranges::minmax(points, {}, [=](const Point& p) { return p[axis]; });
    return most[axis] - least[axis];
  }
};

TEST_F(CStepsTest, AStepIsTakenBackAndDoneAgain) {
  server_.stop();
  open(strip_.mesh());
  hold("base", {0, 1});
  EXPECT_EQ(lpdeform_undo(session_, nullptr, &error_), LPDEFORM_FAILED_PRECONDITION);
  EXPECT_STREQ(error_.reason, "NOT_CONNECTED");
  EXPECT_EQ(hold("tip", {20, 21}), 2);
  server_.start_again();  // numbers go on from those before the connection
  settle(22);
  EXPECT_EQ(lift(1), 3);
  EXPECT_EQ(lift(2), 4);
  EXPECT_EQ(height(), 2);
  EXPECT_EQ(lift(3, true), 5);
  std::uint64_t seq = 0;
  ASSERT_EQ(lpdeform_undo(session_, &seq, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(seq, 6);
  EXPECT_EQ(height(), 2);
  EXPECT_EQ(frame_.input_seq, seq);
  ASSERT_EQ(lpdeform_undo(session_, nullptr, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(height(), 0);  // one drag of two moves
  ASSERT_EQ(lpdeform_redo(session_, nullptr, &error_), LPDEFORM_OK) << error_.message;
  ASSERT_EQ(lpdeform_redo(session_, nullptr, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(height(), 3);
  EXPECT_EQ(lpdeform_redo(session_, nullptr, &error_), LPDEFORM_FAILED_PRECONDITION);
  EXPECT_STREQ(error_.reason, "NOTHING_TO_REDO");
  EXPECT_EQ(lpdeform_undo(nullptr, nullptr, &error_), LPDEFORM_INVALID_ARGUMENT);
}

TEST_F(CStepsTest, AReaderTakesNothingBack) {
  open(strip_.mesh());
  hold("base", {0, 1});
  settle(22);
  std::array<char, 64> name{};
  ASSERT_EQ(lpdeform_session_name(session_, name.data(), name.size(), &error_), LPDEFORM_OK);
  lpdeform_session* reader = nullptr;
  ASSERT_EQ(lpdeform_join(client_, name.data(), LPDEFORM_READER, nullptr, &reader, &error_), LPDEFORM_OK);
  EXPECT_EQ(lpdeform_undo(reader, nullptr, &error_), LPDEFORM_FAILED_PRECONDITION);
  EXPECT_STREQ(error_.reason, "NOT_THE_WRITER");
  lpdeform_close(reader);
}

TEST_F(CStepsTest, ResizingScalesAlongTheEnginesAxes) {
  for (const bool is_unreal : {false, true}) {
    options_.handedness = is_unreal ? LPDEFORM_LEFT_HANDED : LPDEFORM_RIGHT_HANDED;
    options_.up = is_unreal ? LPDEFORM_Z_UP : LPDEFORM_Y_UP;
    options_.units_per_metre = is_unreal ? 100 : 1;
    const float unit = is_unreal ? 100 : 1;
    const std::size_t width = is_unreal ? 1 : 2;  // the strip lies in the plane that is not up
    Strip strip;
    for (Point& p : strip.points) p = is_unreal ? Point{unit * p[0], unit * p[2], unit * p[1]} : p;
    open(strip.mesh());
    lpdeform_resizing resizing{};
    resizing.struct_size = sizeof resizing;
    resizing.scale[0] = 2;
    resizing.scale[width] = 1.5;
    ASSERT_EQ(lpdeform_resize(session_, &resizing, nullptr, &error_), LPDEFORM_OK) << error_.message;
    std::vector<Point> points = settle(22);
    EXPECT_NEAR(extent(points, 0), 20 * unit, 1e-3 * unit);
    EXPECT_NEAR(extent(points, width), 1.5 * unit, 1e-3 * unit);

    lpdeform_resizing along{};  // the width is the first of its axes, and its origin stays
    along.struct_size = sizeof along;
    along.scale[0] = 3;
    along.set_axes = along.set_origin = 1;
    along.x_axis[width] = along.y_axis[0] = 1;
    ASSERT_EQ(lpdeform_resize(session_, &along, nullptr, &error_), LPDEFORM_OK) << error_.message;
    points = settle(22);
    EXPECT_NEAR(extent(points, 0), 10 * unit, 1e-3 * unit);
    EXPECT_NEAR(extent(points, width), 3 * unit, 1e-3 * unit);
    EXPECT_NEAR(points[1][width], 0, 1e-3 * unit);
    lpdeform_close(session_);
    session_ = nullptr;
  }
}

TEST_F(CStepsTest, AResizingThatCannotBeIsRefused) {
  open(strip_.mesh());
  hold("base", {0, 1});
  settle(22);
  lpdeform_resizing resizing{};
  EXPECT_EQ(lpdeform_resize(session_, &resizing, nullptr, &error_), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_STREQ(error_.reason, "STRUCT_SIZE");
  resizing.struct_size = sizeof resizing;
  resizing.reserved = 1;
  EXPECT_EQ(lpdeform_resize(session_, &resizing, nullptr, &error_), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_STREQ(error_.reason, "RESERVED_SET");
  resizing.reserved = 0;
  resizing.scale[1] = 1000;
  ASSERT_EQ(lpdeform_resize(session_, &resizing, nullptr, &error_), LPDEFORM_OK) << error_.message;
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_TRUE(eventually(
      [&] { return lpdeform_poll(session_, &buffers, &frame_, &error_) == LPDEFORM_INVALID_ARGUMENT; }));
  EXPECT_STREQ(error_.reason, "RESIZE_SCALE_OUT_OF_RANGE");
}

TEST_F(CStepsTest, OfSeveralThreadsThatPollNoneKeepsAnOlderFrameForTheRepeat) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  settle(22);
  for (int round = 0; round < 25; ++round) {
    const std::uint64_t seq = lift(0.01 * round);
    std::array<std::uint64_t, 3> newest{};
    std::atomic<bool> is_there = false;
    std::vector<std::thread> threads;
    for (std::uint64_t& taken : newest) {
      threads.emplace_back([&, seq] {
        std::vector<Point> points(22);
        const lpdeform_buffers buffers = buffers_of(points);
        lpdeform_frame frame{};
        frame.struct_size = sizeof frame;
        while (!is_there) {
          if (lpdeform_poll(session_, &buffers, &frame, nullptr) != LPDEFORM_OK) continue;
          taken = frame.frame_seq;
          if (frame.converged == 1 && frame.input_seq == seq) is_there = true;
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
    std::vector<Point> points(22);
    const lpdeform_buffers buffers = buffers_of(points);
    ASSERT_EQ(lpdeform_repeat(session_, &buffers, &frame_, &error_), LPDEFORM_OK);
    ASSERT_EQ(frame_.frame_seq, std::ranges::max(newest));
  }
}

}  // namespace
}  // namespace lpdeform::engine
