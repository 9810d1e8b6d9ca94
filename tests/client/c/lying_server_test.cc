// How the C interface handles a server that violates the contract.

#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/client/c/session_fixture.h"

namespace lpdeform::engine {
namespace {

class LyingServerTest : public testing::Test {
 protected:
  LyingServerTest() { error_.struct_size = sizeof error_; }

  ~LyingServerTest() override {
    lpdeform_disconnect(client_);
    lpdeform_close(session_);
  }

  void start(const client::Lies& lies = {}) {
    server_.emplace(lies);
    open(server_->address());
  }

  void open(const std::string& address) {
    lpdeform_connection connection{};
    connection.struct_size = sizeof connection;
    connection.address = address.c_str();
    connection.connect_timeout_seconds = connection.call_timeout_seconds =
        1e6;  // longer than any test may take
    ASSERT_EQ(lpdeform_connect(&connection, &client_, &error_), LPDEFORM_OK) << error_.message;
    const lpdeform_mesh mesh = triangle_.mesh();
    ASSERT_EQ(lpdeform_open(client_, &mesh, nullptr, &session_, &error_), LPDEFORM_OK) << error_.message;
  }

  lpdeform_state state() { return lpdeform_session_state(session_, &error_); }

  /// A buffer for three vertices, before others that nobody may write to.
  lpdeform_buffers three_of(std::vector<Point>& points) {
    lpdeform_buffers buffers = buffers_of(points);
    buffers.positions.bytes = 3 * sizeof(Point);
    return buffers;
  }

  std::optional<client::LyingServer> server_;
  Triangle triangle_;
  lpdeform_client* client_ = nullptr;
  lpdeform_session* session_ = nullptr;
  lpdeform_error error_{};
};

TEST_F(LyingServerTest, TheTruthIsTaken) {
  start();
  std::vector<Point> points(3);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_EQ(lpdeform_settle(session_, kPatienceSeconds, &buffers, nullptr, &error_), LPDEFORM_OK)
      << error_.message;
}

TEST_F(LyingServerTest, WhatAServerSaysAboutItselfIsHandedOnAndCutWhereThereIsNoRoom) {
  start({{"is_overloaded", 1}});
  std::vector<Point> points(3);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_EQ(lpdeform_settle(session_, kPatienceSeconds, &buffers, nullptr, &error_), LPDEFORM_OK);
  const auto said = [&](std::size_t bytes) {
    std::vector<char> text(bytes + 1, '#');
    EXPECT_EQ(lpdeform_session_notice(session_, text.data(), bytes), LPDEFORM_NOTICE_OVERLOADED);
    EXPECT_EQ(text.back(), '#');  // nobody writes beyond
    return std::string(text.data(), std::find(text.begin(), text.end(), '\0') - text.begin());
  };
  EXPECT_EQ(said(100), "Too m\u00fcch to do.");
  EXPECT_EQ(said(17), "Too m\u00fcch to do.");
  EXPECT_EQ(said(11), "Too m\u00fc...");
  EXPECT_EQ(said(10), "Too m...");  // and not half of a character
  EXPECT_EQ(said(3), "..");
  EXPECT_EQ(said(1), "");
  EXPECT_EQ(said(0), "#");
  EXPECT_EQ(lpdeform_session_notice(session_, nullptr, 0), LPDEFORM_NOTICE_OVERLOADED);
  EXPECT_EQ(lpdeform_session_notice(nullptr, nullptr, 0), LPDEFORM_NOTICE_NONE);
  server_->stop();
  EXPECT_TRUE(
      eventually([&] { return lpdeform_session_notice(session_, nullptr, 0) == LPDEFORM_NOTICE_NONE; }));
}

TEST_F(LyingServerTest, ABetterShapeIsToldWithItsNumbersAndNoMoreOnceItIsTaken) {
  start({{"is_overloaded", 1}, {"has_better", 1}});
  std::vector<Point> points(3);
  const lpdeform_buffers buffers = buffers_of(points);
  EXPECT_EQ(lpdeform_settle(session_, kPatienceSeconds, &buffers, nullptr, &error_), LPDEFORM_OK);
  EXPECT_EQ(lpdeform_session_notice(session_, nullptr, 0), LPDEFORM_NOTICE_BETTER_SHAPE);
  lpdeform_better_shape better{};
  better.struct_size = sizeof better;
  EXPECT_EQ(lpdeform_session_better_shape(session_, &better, &error_), LPDEFORM_OK);
  EXPECT_EQ(better.energy, -1);
  EXPECT_EQ(better.saved_share, 0.25);
  EXPECT_EQ(lpdeform_session_better_shape(session_, nullptr, &error_), LPDEFORM_OK);
  EXPECT_EQ(lpdeform_take_better_shape(session_, &error_), LPDEFORM_OK) << error_.message;
  EXPECT_EQ(server_->takings(), 1);
  EXPECT_EQ(lpdeform_session_notice(session_, nullptr, 0), LPDEFORM_NOTICE_OVERLOADED);
  EXPECT_EQ(lpdeform_session_better_shape(session_, &better, &error_), LPDEFORM_NO_FRAME);
  EXPECT_EQ(lpdeform_session_better_shape(nullptr, &better, &error_), LPDEFORM_INVALID_ARGUMENT);
  EXPECT_EQ(lpdeform_take_better_shape(nullptr, &error_), LPDEFORM_INVALID_ARGUMENT);
}

TEST_F(LyingServerTest, ClosingDoesNotWaitForAServerThatHangs) {
  start({{"deletion_hangs", 1}});
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_LIVE; }));
  lpdeform_close(std::exchange(session_, nullptr));
  lpdeform_disconnect(
      std::exchange(client_, nullptr));  // the timeout of calls is longer than this test may take
  EXPECT_TRUE(eventually([&] { return server_->deletions() == 1; }));
}

TEST_F(LyingServerTest, ASessionOfAnotherMeshIsRefused) {
  start({{"created", 4}});
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_REFUSED; }));
  EXPECT_EQ(error_.code, LPDEFORM_DATA_LOSS);
  EXPECT_STREQ(error_.reason, "FRAME_VERTICES");
}

TEST_F(LyingServerTest, AStreamOfAnotherMeshIsRefused) {
  start({{"opened", 4}, {"framed", 4}});
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_REFUSED; }));
  EXPECT_STREQ(error_.reason, "FRAME_VERTICES");
  EXPECT_STREQ(error_.limit, "vertices = 3");
  std::vector<Point> points(9, Point{7, 7, 7});
  const lpdeform_buffers buffers = three_of(points);
  EXPECT_EQ(lpdeform_poll(session_, &buffers, nullptr, &error_), LPDEFORM_DATA_LOSS);
  EXPECT_EQ(points, std::vector<Point>(9, Point{7, 7, 7}));
}

TEST_F(LyingServerTest, AFrameOfAnotherMeshIsDroppedAndSaidByTheState) {
  start({{"framed", 4}});
  std::vector<Point> points(9, Point{7, 7, 7});
  const lpdeform_buffers buffers = three_of(points);
  EXPECT_TRUE(eventually([&] {
    const lpdeform_code code = lpdeform_poll(session_, &buffers, nullptr, &error_);
    EXPECT_TRUE(code == LPDEFORM_NO_FRAME || code == LPDEFORM_DATA_LOSS)
        << error_.message;  // DATA_LOSS after some tries
    return state() != LPDEFORM_STATE_LIVE && std::string(error_.reason) == "FRAME_PARTS";
  }));
  EXPECT_EQ(error_.code, LPDEFORM_DATA_LOSS);
  EXPECT_EQ(points, std::vector<Point>(9, Point{7, 7, 7}));
}

TEST_F(LyingServerTest, ACallThatTheServerCancelsIsMadeAgain) {
  start({{"failures", 2}});
  EXPECT_TRUE(eventually([&] { return state() == LPDEFORM_STATE_LIVE; })) << error_.message;
  EXPECT_EQ(server_->creations(), 3);
}

TEST_F(LyingServerTest, DisconnectingGivesUpACallThatIsNeverAnswered) {
  start({{"hangs", 1}});
  EXPECT_TRUE(eventually([&] { return server_->creations() > 0; }));
  lpdeform_disconnect(client_);  // ends at all
  client_ = nullptr;
  EXPECT_EQ(state(), LPDEFORM_STATE_REFUSED);
}

TEST_F(LyingServerTest, DisconnectingGivesUpConnectionsThatAreNeverMade) {
  const client::SilentServer server;
  open(server.address());
  std::vector<lpdeform_session*> others(8);
  const lpdeform_mesh mesh = triangle_.mesh();
  for (lpdeform_session*& other : others) {
    ASSERT_EQ(lpdeform_open(client_, &mesh, nullptr, &other, &error_), LPDEFORM_OK);
  }
  EXPECT_EQ(state(), LPDEFORM_STATE_CONNECTING);
  lpdeform_disconnect(client_);
  client_ = nullptr;
  for (lpdeform_session* const other : others) lpdeform_close(other);
}

}  // namespace
}  // namespace lpdeform::engine
