// Sessions as files, against a real server in this process.

#include <string>
#include <utility>
#include <vector>

#include "tests/client/c/session_fixture.h"

namespace lpdeform::engine {
namespace {

class CSnapshotTest : public CSessionTest {
 protected:
  std::string snapshot() {
    lpdeform_snapshot* taken = nullptr;
    EXPECT_EQ(lpdeform_take_snapshot(session_, &taken, &error_), LPDEFORM_OK) << error_.message;
    std::size_t bytes = 0;
    const void* const data = lpdeform_snapshot_data(taken, &bytes);
    std::string file(static_cast<const char*>(data), bytes);
    lpdeform_free_snapshot(taken);
    return file;
  }

  void restore(const std::string& file) {
    lpdeform_close(session_);
    session_ = nullptr;
    ASSERT_EQ(lpdeform_restore(client_, file.data(), file.size(), &options_, &session_, &error_), LPDEFORM_OK)
        << error_.message;
  }

  void lift(double height, bool begins_step = false) {
    const lpdeform_move move{"tip", shift(0, height, 0)};
    lpdeform_update update{};
    update.struct_size = sizeof update;
    update.moves = &move;
    update.move_count = 1;
    update.begins_step = begins_step;
    EXPECT_EQ(lpdeform_send(session_, &update, nullptr, &error_), LPDEFORM_OK) << error_.message;
  }

  /// The next frame, whichever it is.
  std::vector<Point> next_frame(std::size_t count) {
    std::vector<Point> points(count);
    const lpdeform_buffers buffers = buffers_of(points);
    EXPECT_TRUE(eventually([&] {
      return lpdeform_vertex_count(session_) == count &&
             lpdeform_poll(session_, &buffers, &frame_, &error_) == LPDEFORM_OK;
    })) << error_.message;
    return points;
  }
};

TEST_F(CSnapshotTest, ComesBackTheSameWithItsStepsAndIsRecreatedFromItsFile) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21}, shift(0, 1, 0));
  settle(22);
  lift(2);    // one step with the next, which comes within a second
  lift(2.5);  // not waited for, and in the file all the same
  const std::string file = snapshot();
  EXPECT_EQ(settle(22)[20][1], 2.5);  // the session goes on

  restore(file);
  EXPECT_EQ(settle(22)[20][1], 2.5);
  ASSERT_EQ(lpdeform_undo(session_, nullptr, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(settle(22)[20][1], 1);  // one drag
  lift(4);
  EXPECT_EQ(settle(22)[20][1], 4);
  server_.stop();
  server_.start_again();
  lift(5, true);
  EXPECT_EQ(settle(22)[20][1], 5);
  ASSERT_EQ(lpdeform_undo(session_, nullptr, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(settle(22)[20][1], 4);  // what came after the file is there, too
}

TEST_F(CSnapshotTest, ShowsTheSameSurfaceInTheCoordinatesThatAreAskedFor) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21}, shift(1, 2, 0));
  const std::vector<Point> before = settle(22);
  const std::string file = snapshot();
  options_.handedness = LPDEFORM_LEFT_HANDED;
  options_.up = LPDEFORM_Z_UP;
  options_.units_per_metre = 100;
  restore(file);
  const std::vector<Point> in_unreal = next_frame(22);
  for (std::size_t i = 0; i < before.size(); ++i) {  // or already a step further
    EXPECT_NEAR(in_unreal[i][0], 100 * before[i][0], 0.1);
    EXPECT_NEAR(in_unreal[i][2], 100 * before[i][1], 0.1);
  }
}

TEST_F(CSnapshotTest, FilesThatAreNoneAreRefusedByName) {
  open(strip_.mesh());
  hold("base", {0, 1});
  settle(22);
  const std::string file = snapshot();
  std::string damaged = file;
  damaged[file.size() / 2] ^= 1;
  const std::pair<std::string, const char*> wrong[] = {
      {"a poem", "SNAPSHOT_FOREIGN"},
      {file.substr(0, file.size() - 9), "SNAPSHOT_TRUNCATED"},
      {damaged, "SNAPSHOT_DAMAGED"},
  };
  for (const auto& [bytes, reason] : wrong) {
    restore(bytes);
    EXPECT_TRUE(eventually([this] { return state() == LPDEFORM_STATE_REFUSED; }));
    EXPECT_STREQ(error_.reason, reason);
  }
}

TEST_F(CSnapshotTest, WhatCannotBeTakenIsSaid) {
  lpdeform_snapshot* taken = nullptr;
  EXPECT_EQ(lpdeform_take_snapshot(nullptr, &taken, &error_), LPDEFORM_INVALID_ARGUMENT);
  server_.stop();
  open(strip_.mesh());
  EXPECT_EQ(lpdeform_take_snapshot(session_, nullptr, &error_), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_EQ(lpdeform_take_snapshot(session_, &taken, &error_), LPDEFORM_FAILED_PRECONDITION);
  EXPECT_STREQ(error_.reason, "NOT_CONNECTED");
  EXPECT_EQ(taken, nullptr);
  server_.start_again();
  hold("base", {0, 1});
  settle(22);

  lpdeform_session* none = nullptr;
  EXPECT_EQ(lpdeform_restore(nullptr, "", 0, nullptr, &none, &error_), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_EQ(lpdeform_restore(client_, nullptr, 3, nullptr, &none, &error_), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_STREQ(error_.element, "data");
  EXPECT_EQ(none, nullptr);
  std::size_t bytes = 1;
  EXPECT_EQ(lpdeform_snapshot_data(nullptr, &bytes), nullptr);
  EXPECT_EQ(bytes, 0u);
  lpdeform_free_snapshot(nullptr);
}

}  // namespace
}  // namespace lpdeform::engine
