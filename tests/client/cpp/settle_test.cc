#include <gtest/gtest.h>

#include <thread>

#include "tests/client/link_fixture.h"

namespace lpdeform::client {
namespace {

class SettleTest : public LinkTest {
 protected:
  /// A stream whose update 1 is answered, and has no frame yet.
  std::shared_ptr<Stream> answered_stream() {
    open();
    const auto stream = opened_stream();
    EXPECT_EQ(link_->update(adding("base")).value(), 1u);
    answer(*stream, 1);
    return stream;
  }

  /// The same with a final frame, which is taken.
  std::shared_ptr<Stream> settled_stream() {
    const auto stream = answered_stream();
    stream->say(frame(1, 1));
    EXPECT_TRUE(next_frame().ok());
    return stream;
  }

  /// The client's next update has come.
  static void hear_update(Stream& stream) {
    for (auto request = stream.hear(); request && !request->has_update();) request = stream.hear();
  }

  /// Takes the client's next update in.
  static void answer(Stream& stream, std::uint64_t input_seq) {
    hear_update(stream);
    stream.say(result(input_seq));
  }

  /// Ends the session, and waits until the client knows.
  void replace_writer(Stream& stream) {
    stream.say(go_away(v1::GO_AWAY_REASON_WRITER_REPLACED));
    stream.end(absl::OkStatus());
    const auto end = FrameBox::Clock::now() + kPatience;
    while (link_->ended().ok() && FrameBox::Clock::now() < end) std::this_thread::yield();
    EXPECT_FALSE(link_->ended().ok());
  }

  absl::StatusOr<Frame> settle_now() { return link_->settle(FrameBox::Clock::now()); }
  absl::StatusOr<Frame> settle() { return link_->settle(FrameBox::Clock::now() + kPatience); }
};

TEST_F(SettleTest, ReturnsTheResultThatWasTakenAtOnceAndAsOftenAsItIsAskedFor) {
  settled_stream();
  for (int k = 0; k < 3; ++k) EXPECT_EQ(settle_now().value().frame_seq, 1u);
}

TEST_F(SettleTest, ReturnsTheTakenResultWhileTheConnectionIsDown) {
  settled_stream()->end(absl::UnavailableError("gone"));
  ASSERT_NE(rpc_->next_stream(), nullptr);  // which is never answered
  EXPECT_EQ(settle_now().value().frame_seq, 1u);
}

TEST_F(SettleTest, WaitsWhereANewerUpdateIsUnderWay) {
  const auto stream = settled_stream();
  EXPECT_EQ(link_->update(adding("tip")).value(), 2u);
  EXPECT_EQ(fault_of(settle_now().status()).reason, "NO_FRAME");
  answer(*stream, 2);
  stream->say(frame(2, 2));
  EXPECT_EQ(settle().value().frame_seq, 2u);
}

TEST_F(SettleTest, ReturnsTheResultBeforeAnUpdateThatWasRefusedOnceThatIsSaid) {
  const auto stream = settled_stream();
  EXPECT_EQ(link_->update(adding("tip")).value(), 2u);
  hear_update(*stream);
  stream->say(refusal(2));
  EXPECT_EQ(fault_of(settle().status()).reason, "HANDLE_VERTEX_OUT_OF_RANGE");
  EXPECT_EQ(settle_now().value().frame_seq, 1u);
}

TEST_F(SettleTest, ReturnsTheResultThoughTheSessionHasEndedRightAfterIt) {
  const auto stream = answered_stream();
  stream->say(frame(1, 1));
  replace_writer(*stream);
  EXPECT_EQ(settle().value().frame_seq, 1u);
  EXPECT_EQ(fault_of(next_frame().status()).reason, "WRITER_REPLACED");
}

TEST_F(SettleTest, SaysWhyTheSessionHasEndedWhereThatDroppedANewerUpdate) {
  const auto stream = answered_stream();
  stream->say(frame(1, 1));
  EXPECT_EQ(link_->update(adding("tip")).value(), 2u);
  hear_update(*stream);
  replace_writer(*stream);
  EXPECT_EQ(fault_of(settle().status()).reason, "WRITER_REPLACED");
}

TEST_F(SettleTest, GivesTheResultToEveryThreadThatWaitsForIt) {
  open();
  const auto stream = opened_stream();
  link_->update(adding("base")).value();
  std::vector<absl::StatusOr<Frame>> results(3, absl::UnknownError(""));
  {
    std::vector<std::jthread> waiting;
    for (auto& one : results) waiting.emplace_back([this, &one] { one = settle(); });
    answer(*stream, 1);
    stream->say(frame(1, 1));
  }
  for (const auto& one : results) EXPECT_EQ(one.value().frame_seq, 1u);
}

TEST_F(SettleTest, WaitsForANewFrameOnceItHasTakenOver) {
  settled_stream();
  ASSERT_TRUE(link_->take_over().ok());
  EXPECT_EQ(fault_of(settle_now().status()).reason, "NO_FRAME");
}

TEST_F(SettleTest, SaysWhyTheSessionIsOverThoughAResultWasTaken) {
  settled_stream();
  ASSERT_TRUE(link_->close().ok());
  EXPECT_EQ(fault_of(settle_now().status()).reason, "SESSION_CLOSED");
}

}  // namespace
}  // namespace lpdeform::client
