// A session of the C interface against a real server in this process: how it begins, goes on and ends.

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <thread>
#include <tuple>
#include <vector>

#include "tests/client/c/session_fixture.h"

namespace lpdeform::engine {
namespace {

TEST_F(CSessionTest, WorksThoughTheServerComesLater) {
  server_.stop();
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  lpdeform_motion up = shift(0, 2, 0);
  std::uint64_t seq = 0;
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &up, &seq, &error_), LPDEFORM_OK);
  EXPECT_EQ(seq, 3);
  std::vector<Point> points(22, Point{7, 7, 7});
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_EQ(lpdeform_poll(session_, &buffers, &frame_, &error_), LPDEFORM_NO_FRAME);
  EXPECT_EQ(points[0][0], 7);
  EXPECT_TRUE(eventually(
      [&] { return state() == LPDEFORM_STATE_CONNECTING && error_.code == LPDEFORM_UNAVAILABLE; }));
  EXPECT_STREQ(error_.reason, "NO_SERVER");

  server_.start_again();
  points = settle(22);
  EXPECT_EQ(state(), LPDEFORM_STATE_LIVE);
  EXPECT_EQ(points[20][1], 2);
  EXPECT_EQ(points[0][1], 0);
  EXPECT_GE(frame_.input_seq, seq);
  EXPECT_EQ(frame_.is_final, 1);
}

TEST_F(CSessionTest, NoFrameClaimsAChangeThatItDoesNotHave) {
  server_.stop();
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  const lpdeform_motion up = shift(0, 2, 0);
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &up, nullptr, &error_), LPDEFORM_OK);
  server_.start_again();
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_TRUE(eventually([&] {
    if (lpdeform_poll(session_, &buffers, &frame_, &error_) != LPDEFORM_OK) return false;
    EXPECT_TRUE(frame_.input_seq == 0 || points[20][1] == 2) << frame_.input_seq;
    return frame_.input_seq == 3 && frame_.is_final == 1;
  }));
}

TEST_F(CSessionTest, NumbersOfChangesGoOnFromThoseBeforeTheConnection) {
  server_.stop();
  open(strip_.mesh());
  hold("base", {0, 1});
  EXPECT_EQ(hold("tip", {20, 21}), 2);
  server_.start_again();
  settle(22);
  EXPECT_EQ(frame_.input_seq, 2);
  const lpdeform_motion up = shift(0, 1, 0);
  std::uint64_t seq = 0;
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &up, &seq, &error_), LPDEFORM_OK);
  EXPECT_EQ(seq, 3);
  settle(22);
  EXPECT_EQ(frame_.input_seq, 3);
}

TEST_F(CSessionTest, AMeshThatTheServerRefusesIsSaidByTheState) {
  strip_.indices[4] = 99;
  open(strip_.mesh());
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_REFUSED; }));
  EXPECT_EQ(error_.code, LPDEFORM_INVALID_ARGUMENT);
  EXPECT_STREQ(error_.reason, "MESH_INDEX_OUT_OF_RANGE");
  EXPECT_STREQ(error_.element, "face 1");
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_EQ(lpdeform_poll(session_, &buffers, &frame_, &error_), LPDEFORM_INVALID_ARGUMENT);
}

TEST_F(CSessionTest, ARefusedChangeIsSaidOnceAndTheSessionGoesOn) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  settle(22);
  hold("beyond", {22});
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = buffers_of(points);
  int said = 0;
  const auto is_said = [&] {
    const lpdeform_code code = lpdeform_poll(session_, &buffers, &frame_, &error_);
    if (code == LPDEFORM_INVALID_ARGUMENT) ++said;
    return said == 1;
  };
  EXPECT_TRUE(eventually(is_said));
  EXPECT_STREQ(error_.reason, "HANDLE_VERTEX_OUT_OF_RANGE");
  EXPECT_STREQ(error_.element, "vertex 22");
  EXPECT_EQ(state(), LPDEFORM_STATE_LIVE);
  const lpdeform_motion up = shift(0, 1, 0);
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &up, nullptr, &error_), LPDEFORM_OK);
  EXPECT_EQ(settle(22)[20][1], 1);
}

TEST_F(CSessionTest, ANameThatIsNotUtf8IsRefusedAtTheCallAndTheSessionGoesOn) {
  server_.stop();
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  const lpdeform_motion up = shift(0, 1, 0);
  for (const bool is_live : {false, true}) {
    if (is_live) {
      server_.start_again();
      settle(22);
    }
    EXPECT_EQ(lpdeform_move_handle(session_, "t\xffip", &up, nullptr, &error_), LPDEFORM_INVALID_ARGUMENT);
    EXPECT_STREQ(error_.reason, "NAME_ENCODING");
    EXPECT_STREQ(error_.element, "handle \"t\\xffip\"");
  }
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &up, nullptr, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(settle(22)[20][1], 1);
  lpdeform_session* none = nullptr;
  EXPECT_EQ(lpdeform_join(client_, "sessions/\xff", LPDEFORM_READER, nullptr, &none, &error_),
            LPDEFORM_INVALID_ARGUMENT);
}

TEST_F(CSessionTest, SolvingGivesAResultOfItsOwnBesideTheFrames) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21}, shift(-1, 2, 0));
  std::vector<Point> points(22), normals(22);
  lpdeform_buffers buffers = buffers_of(points);
  buffers.normals = buffers_of(normals).positions;
  lpdeform_solve_options options{};
  options.struct_size = sizeof options;
  options.certify = 1;
  ASSERT_EQ(lpdeform_solve(session_, &options, &buffers, &frame_, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(frame_.stop_reason, LPDEFORM_CONVERGED);
  EXPECT_EQ(frame_.has_optimality_gap, 1);
  EXPECT_LT(frame_.optimality_gap, 1e-3);
  EXPECT_EQ(frame_.input_seq, 2);
  EXPECT_EQ(points[20], (Point{9, 2, 1}));
  EXPECT_GT(normals[0][1], 0);
  const std::vector<Point> shown = settle(22);
  for (std::size_t i = 0; i < 22; ++i) {
    // The solve's tolerance, of an extent of 10.
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(shown[i][k], points[i][k], 1e-3);
  }
  ASSERT_EQ(lpdeform_remove_handle(session_, "tip", nullptr, &error_), LPDEFORM_OK);
  ASSERT_EQ(lpdeform_remove_handle(session_, "base", nullptr, &error_), LPDEFORM_OK);
  EXPECT_EQ(lpdeform_solve(session_, nullptr, &buffers, nullptr, &error_), LPDEFORM_FAILED_PRECONDITION);
  EXPECT_STREQ(error_.reason, "NO_HANDLES");
}

TEST_F(CSessionTest, ASolveTellsWhatItHasSearchedAsFarAsThereIsRoom) {
  std::vector<Point> grid;  // of 121 vertices: enough to be searched
  std::vector<std::uint32_t> indices;
  for (std::uint32_t v = 0; v < 121; ++v) grid.push_back({float(v / 11), 0, float(v % 11)});
  for (std::uint32_t v = 0; v < 110; ++v) {
    if (v % 11 == 10) continue;
    for (const std::uint32_t corner : {0U, 1U, 12U, 0U, 12U, 11U}) indices.push_back(v + corner);
  }
  open(mesh_of(grid, indices));
  hold("base", {0, 1, 2});
  hold("tip", {118, 119, 120}, shift(-6, 3, 0));
  lpdeform_settings settings{};
  settings.struct_size = sizeof settings;
  settings.p = 1.5;
  settings.set_solver = settings.set_search = 1;
  settings.search_effort = 1;
  ASSERT_EQ(lpdeform_set(session_, &settings, nullptr, &error_), LPDEFORM_OK) << error_.message;
  std::vector<Point> points(121);
  const lpdeform_buffers buffers = buffers_of(points);
  std::array<double, 13> minima{};
  lpdeform_search search{};
  search.struct_size = sizeof search;
  search.minima = minima.data();
  search.minima_capacity = minima.size();
  lpdeform_solve_options options{};
  options.struct_size = sizeof options;
  options.search = &search;
  ASSERT_EQ(lpdeform_solve(session_, &options, &buffers, &frame_, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(search.effort, 1);
  EXPECT_EQ(search.further_starts, 12);
  EXPECT_GT(search.search_iterations, 0);
  EXPECT_LT(search.search_iterations, frame_.iteration);
  ASSERT_GE(search.minima_count, 1);
  ASSERT_LE(search.minima_count, minima.size());
  EXPECT_EQ(std::ranges::min(std::span(minima).first(search.minima_count)), frame_.energy);

  settings.search_effort = -1;
  ASSERT_EQ(lpdeform_set(session_, &settings, nullptr, &error_), LPDEFORM_OK) << error_.message;
  search.minima_capacity = 0;
  minima = {-1};
  ASSERT_EQ(lpdeform_solve(session_, &options, &buffers, &frame_, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(std::tuple(search.minima_count, search.further_starts, search.search_iterations, search.effort),
            std::tuple(1, 0, 0, 0));
  EXPECT_EQ(minima[0], -1);

  search.minima = nullptr;
  search.minima_capacity = 1;
  EXPECT_EQ(lpdeform_solve(session_, &options, &buffers, nullptr, &error_), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_STREQ(error_.element, "search.minima");
  options.struct_size = offsetof(lpdeform_solve_options, search);  // of a caller that does not know it
  EXPECT_EQ(lpdeform_solve(session_, &options, &buffers, nullptr, &error_), LPDEFORM_OK) << error_.message;
}

TEST_F(CSessionTest, TheLastFrameStaysWhileTheServerIsAwayAndWorkGoesOnAfter) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21}, shift(0, 2, 0));
  settle(22);
  server_.stop();
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_RECONNECTING; }));
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_EQ(lpdeform_repeat(session_, &buffers, &frame_, &error_), LPDEFORM_OK);
  EXPECT_EQ(points[20][1], 2);
  const lpdeform_motion higher = shift(0, 3, 0);
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &higher, nullptr, &error_), LPDEFORM_OK);
  server_.start_again();  // it knows nothing of the session
  EXPECT_EQ(settle(22)[20][1], 3);
  EXPECT_EQ(state(), LPDEFORM_STATE_LIVE);
}

TEST_F(CSessionTest, ASessionIsOverAfterReconnectSeconds) {
  lpdeform_disconnect(client_);
  client_ = nullptr;
  server_.stop();
  lpdeform_connection connection{};
  connection.struct_size = sizeof connection;
  connection.address = address_.c_str();
  connection.reconnect_seconds = 0.05;
  ASSERT_EQ(lpdeform_connect(&connection, &client_, &error_), LPDEFORM_OK);
  open(strip_.mesh());
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_REFUSED; }));
  EXPECT_EQ(error_.code, LPDEFORM_UNAVAILABLE);
}

TEST_F(CSessionTest, ClosingAndDisconnectingWithoutAServerEnds) {
  open(strip_.mesh());
  hold("base", {0, 1});
  settle(22);
  server_.stop();
  lpdeform_disconnect(client_);  // the session's end cannot be told to anybody
  client_ = nullptr;
  EXPECT_EQ(state(), LPDEFORM_STATE_REFUSED);
  EXPECT_STREQ(error_.reason, "SESSION_CLOSED");
}

TEST_F(CSessionTest, BuffersThatDoNotFitLoseNoFrame) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21}, shift(0, 2, 0));
  std::vector<Point> few(21);
  const lpdeform_buffers too_small = buffers_of(few);
  EXPECT_TRUE(eventually(
      [&] { return lpdeform_poll(session_, &too_small, &frame_, &error_) == LPDEFORM_INVALID_ARGUMENT; }));
  EXPECT_STREQ(error_.reason, "BUFFER_TOO_SMALL");
  EXPECT_STREQ(error_.limit, "bytes >= 264");
  EXPECT_EQ(settle(22)[20][1], 2);
}

TEST_F(CSessionTest, AReaderLooksOnAndChangesNothing) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21}, shift(0, 2, 0));
  const std::vector<Point> seen = settle(22);
  std::array<char, 64> name{};
  ASSERT_EQ(lpdeform_session_name(session_, name.data(), name.size(), &error_), LPDEFORM_OK);
  EXPECT_EQ(lpdeform_session_name(session_, name.data(), 10, &error_), LPDEFORM_INVALID_ARGUMENT);

  lpdeform_session* reader = nullptr;
  ASSERT_EQ(lpdeform_join(client_, name.data(), LPDEFORM_READER, nullptr, &reader, &error_), LPDEFORM_OK);
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_EQ(lpdeform_settle(reader, kPatienceSeconds, &buffers, &frame_, &error_), LPDEFORM_OK)
      << error_.message;
  EXPECT_EQ(lpdeform_vertex_count(reader), 22);
  EXPECT_EQ(points, seen);
  EXPECT_EQ(lpdeform_remove_handle(reader, "tip", nullptr, &error_), LPDEFORM_FAILED_PRECONDITION);
  EXPECT_STREQ(error_.reason, "NOT_THE_WRITER");
  lpdeform_close(reader);
}

TEST_F(CSessionTest, AnotherWriterTakesOverAndItsChangesBeforeItIsThereCount) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  settle(22);
  std::array<char, 64> name{};
  ASSERT_EQ(lpdeform_session_name(session_, name.data(), name.size(), &error_), LPDEFORM_OK);

  lpdeform_session* writer = nullptr;
  ASSERT_EQ(lpdeform_join(client_, name.data(), LPDEFORM_WRITER, nullptr, &writer, &error_), LPDEFORM_OK);
  const lpdeform_motion up = shift(0, 1, 0);
  std::uint64_t seq = 0;
  ASSERT_EQ(lpdeform_move_handle(writer, "tip", &up, &seq, &error_), LPDEFORM_OK) << error_.message;
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = buffers_of(points);
  ASSERT_EQ(lpdeform_settle(writer, kPatienceSeconds, &buffers, &frame_, &error_), LPDEFORM_OK)
      << error_.message;
  EXPECT_EQ(points[20][1], 1);
  EXPECT_GE(frame_.input_seq, seq);

  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_REFUSED; }));
  EXPECT_EQ(error_.code, LPDEFORM_ABORTED);
  EXPECT_STREQ(error_.reason, "WRITER_REPLACED");
  EXPECT_EQ(lpdeform_move_handle(session_, "tip", &up, nullptr, &error_), LPDEFORM_ABORTED);
  lpdeform_close(writer);
}

TEST_F(CSessionTest, ManyThreadsAtOnceAreFine) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21});
  settle(22);
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      std::vector<Point> points(22);
      const lpdeform_buffers buffers = buffers_of(points);
      lpdeform_error error{};
      error.struct_size = sizeof error;
      for (int k = 0; k < 200; ++k) {
        const lpdeform_motion motion = shift(0, 0.001 * (k + t), 0);
        EXPECT_EQ(lpdeform_move_handle(session_, "tip", &motion, nullptr, &error), LPDEFORM_OK)
            << error.message;
        const lpdeform_code code = lpdeform_poll(session_, &buffers, nullptr, &error);
        EXPECT_TRUE(code == LPDEFORM_OK || code == LPDEFORM_NO_FRAME) << error.message;
        lpdeform_session_state(session_, &error);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const lpdeform_motion last = shift(0, 5, 0);
  ASSERT_EQ(lpdeform_move_handle(session_, "tip", &last, nullptr, &error_), LPDEFORM_OK);
  EXPECT_EQ(settle(22)[20][1], 5);
}

TEST_F(CSessionTest, SettingsAndFieldsReachTheSolver) {
  open(strip_.mesh());
  hold("base", {0, 1});
  hold("tip", {20, 21}, shift(-4, 3, 0));
  settle(22);
  const double even = frame_.energy;
  std::vector<double> p(22, 1.5);
  lpdeform_settings settings{};
  settings.struct_size = sizeof settings;
  settings.p_per_vertex = p.data();
  settings.p_count = 22;
  ASSERT_EQ(lpdeform_set(session_, &settings, nullptr, &error_), LPDEFORM_OK) << error_.message;
  settle(22);
  EXPECT_NE(frame_.energy, even);
  settings.p_count = 21;
  ASSERT_EQ(lpdeform_set(session_, &settings, nullptr, &error_), LPDEFORM_OK);
  std::vector<Point> points(22);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_TRUE(eventually(
      [&] { return lpdeform_poll(session_, &buffers, &frame_, &error_) == LPDEFORM_INVALID_ARGUMENT; }));
  EXPECT_STREQ(error_.reason, "FIELD_SIZE");
}

}  // namespace
}  // namespace lpdeform::engine
