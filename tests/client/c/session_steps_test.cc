// Undo, resizing, and several threads that ask for frames, against a real server in this process.

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

TEST_F(CStepsTest, ASessionRecreatedTakesBackWhatCameAfterThatAndNotAllItsHandles) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21}, shift(0, 1, 0));
  EXPECT_EQ(height(), 1);
  server_.stop();
  server_.start_again();
  lift(3);
  EXPECT_EQ(height(), 3);
  ASSERT_EQ(lpdeform_undo(session_, nullptr, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(height(), 1);
  EXPECT_EQ(lpdeform_undo(session_, nullptr, &error_), LPDEFORM_FAILED_PRECONDITION);
  EXPECT_STREQ(error_.reason, "NOTHING_TO_UNDO");
  ASSERT_EQ(lpdeform_redo(session_, nullptr, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(height(), 3);
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

/// Of cells x cells squares, so that to write a frame takes a while.
struct Sheet {
  explicit Sheet(std::uint32_t cells) {
    const std::uint32_t side = cells + 1;
    for (std::uint32_t i = 0; i < side * side; ++i) points.push_back({float(i % side), 0, -float(i / side)});
    for (std::uint32_t k = 0; k < cells * cells; ++k) {
      const std::uint32_t a = k / cells * side + k % cells;
      for (const std::uint32_t corner : {a, a + 1, a + side + 1, a, a + side + 1, a + side})
        indices.push_back(corner);
    }
  }

  std::vector<Point> points;
  std::vector<std::uint32_t> indices;
};

TEST_F(CStepsTest, OfSeveralThreadsThatPollNonePutsAnOlderFrameOverANewerOne) {
  const Sheet sheet(60);
  open(mesh_of(sheet.points, sheet.indices));
  hold("base", {0, 1, 2});
  hold("tip", {3718, 3719, 3720});
  settle(sheet.points.size());
  std::atomic<bool> is_over = false;
  std::vector<std::thread> pollers;
  for (int k = 0; k < 3; ++k) {
    pollers.emplace_back([&] {
      std::vector<Point> points(sheet.points.size());
      const lpdeform_buffers buffers = buffers_of(points);
      while (!is_over) lpdeform_poll(session_, &buffers, nullptr, nullptr);
    });
  }
  std::vector<Point> points(sheet.points.size());
  const lpdeform_buffers buffers = buffers_of(points);
  std::uint64_t newest = frame_.frame_seq;
  for (int seen = 0, k = 0; seen < 100; ++k) {
    if (k % 50 == 0) lift(1 + 1e-3 * k);
    EXPECT_EQ(lpdeform_repeat(session_, &buffers, &frame_, &error_), LPDEFORM_OK);
    EXPECT_GE(frame_.frame_seq, newest);
    if (HasFailure()) break;  // the threads are to be joined
    seen += frame_.frame_seq > newest;
    newest = frame_.frame_seq;
  }
  is_over = true;
  for (std::thread& poller : pollers) poller.join();
}

}  // namespace
}  // namespace lpdeform::engine
