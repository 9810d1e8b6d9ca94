#include "server/session/frame_stream.h"

#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "core/base/fault.h"
#include "manual_timers.h"
#include "server/session/publisher.h"

namespace lpdeform {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint32_t kManyVertices = 200000;

class FrameStreamTest : public testing::Test {
 protected:
  std::shared_ptr<FrameStream> open(StreamOptions options = {}) {
    auto stream = std::make_shared<FrameStream>(options, publisher_, timers_, seconds(15), OpenedNote{1, 0});
    stream->start([this] { ++wakes_; });
    EXPECT_TRUE(publisher_->add(stream));
    EXPECT_TRUE(std::holds_alternative<OpenedNote>(stream->next().value()));
    return stream;
  }

  std::shared_ptr<const Surface> surface(std::uint32_t vertices = 2) {
    return std::make_shared<Surface>(Points::Constant(vertices, 3, 0.5), Field::Constant(vertices, 0.25));
  }

  /// Publishes a frame that answers `input` of as many inputs.
  std::shared_ptr<const Frame> publish(std::uint64_t input, bool is_final = false,
                                       std::uint32_t vertices = 2) {
    Frame frame;
    frame.input_seq = frame.taken = input;
    frame.is_final = is_final;
    frame.surface = surface(vertices);
    return publisher_->publish(frame);
  }

  /// The frame_seqs of all pieces that can be sent now.
  static std::vector<FramePiece> drain(FrameStream& stream) {
    std::vector<FramePiece> pieces;
    while (const auto note = stream.next()) {
      if (const auto* const piece = std::get_if<FramePiece>(&*note)) pieces.push_back(*piece);
    }
    return pieces;
  }

  std::shared_ptr<ManualTimers> timers_ = std::make_shared<ManualTimers>();
  std::shared_ptr<Metrics> metrics_ = std::make_shared<Metrics>();
  std::shared_ptr<Publisher> publisher_ = std::make_shared<Publisher>(metrics_);
  int wakes_ = 0;
};

TEST_F(FrameStreamTest, TellsHowLongAFrameHasWaitedForItsReaderAndWhatItWasEndedFor) {
  const auto stream = open({.credit = 1});
  publish(1);
  drain(*stream);
  timers_->advance(seconds(3));
  EXPECT_EQ(stream->waited_for_credit(), seconds(0));  // it has taken all there was
  publish(2);
  drain(*stream);
  timers_->advance(seconds(7));
  publish(3);
  drain(*stream);
  EXPECT_EQ(stream->waited_for_credit(), seconds(7));
  ASSERT_TRUE(stream->acknowledge(1).ok());
  drain(*stream);
  EXPECT_EQ(stream->waited_for_credit(), seconds(0));
  EXPECT_EQ(stream->ended_by(), std::nullopt);
  stream->end(EndReason::kElsewhere, "");
  EXPECT_EQ(stream->ended_by(), EndReason::kElsewhere);
}

TEST_F(FrameStreamTest, SendsNoMoreThanItsCreditAndThenTheNewest) {
  const auto stream = open({.credit = 2});
  std::vector<std::uint64_t> sent;
  for (std::uint64_t input = 1; input <= 10; ++input) {
    publish(input, input == 10);
    for (const FramePiece& piece : drain(*stream)) sent.push_back(piece.frame->input_seq);
  }
  EXPECT_EQ(sent, (std::vector<std::uint64_t>{1, 2}));
  EXPECT_FALSE(stream->wants_frame(11));
  ASSERT_TRUE(stream->acknowledge(1).ok());
  const auto next = drain(*stream);
  ASSERT_EQ(next.size(), 1u);
  EXPECT_EQ(next[0].frame->input_seq, 10u);
  EXPECT_TRUE(next[0].frame->is_final);
  EXPECT_EQ(next[0].skipped_inputs, 7u);
  EXPECT_TRUE(drain(*stream).empty());
}

TEST_F(FrameStreamTest, CountsThatAReaderWithoutCreditStalledOnceAndMissedFrames) {
  const auto has_line = [&](const std::string& line) {
    return metrics_->text().find("\n" + line + "\n") != std::string::npos;
  };
  const auto stream = open({.credit = 1});
  publisher_->took(1, std::chrono::steady_clock::now());
  for (const std::uint64_t input : {1, 2, 3, 4}) {  // the first goes out, the rest wait
    publish(input);
    drain(*stream);
  }
  EXPECT_TRUE(has_line("lpdeform_credit_stalls_total 1"));
  ASSERT_TRUE(stream->acknowledge(1).ok());
  drain(*stream);
  EXPECT_TRUE(has_line("lpdeform_frames_published_total 4"));
  EXPECT_TRUE(has_line("lpdeform_frames_sent_total 2"));
  EXPECT_TRUE(has_line("lpdeform_frames_superseded_total 2"));
  EXPECT_TRUE(has_line("lpdeform_input_to_frame_seconds_count 1"));
}

TEST_F(FrameStreamTest, TheFrameWithACertificateGoesToThoseWhoAskedOrHaveNotSeenIt) {
  const auto plain = open({.credit = 8});
  const auto certified = open({.credit = 8, .with_certificate = true});
  const auto slow = open({.credit = 1});
  publish(1);
  drain(*slow);
  publish(2, true);
  EXPECT_EQ(drain(*plain).size(), 1u);
  EXPECT_EQ(drain(*certified).size(), 1u);
  publisher_->certify_newest(0.25);
  EXPECT_TRUE(drain(*plain).empty());
  const auto again = drain(*certified);
  ASSERT_EQ(again.size(), 1u);
  EXPECT_EQ(again[0].frame->optimality_gap, 0.25);
  EXPECT_EQ(again[0].frame->frame_seq, 3u);
  EXPECT_EQ(again[0].skipped_inputs, 0u);
  ASSERT_TRUE(slow->acknowledge(1).ok());
  const auto late = drain(*slow);
  ASSERT_EQ(late.size(), 1u);
  EXPECT_TRUE(late[0].frame->is_final);
  publisher_->begin_epoch(2);
  EXPECT_EQ(drain(*plain).size(), 1u);
}

TEST_F(FrameStreamTest, AcknowledgingALaterFrameAcknowledgesThoseBefore) {
  const auto stream = open({.credit = 2});
  publish(1);
  drain(*stream);
  publish(2);
  drain(*stream);
  ASSERT_TRUE(stream->acknowledge(2).ok());
  publish(3);
  EXPECT_EQ(drain(*stream).size(), 1u);
  publish(4);
  EXPECT_EQ(drain(*stream).size(), 1u);
}

TEST_F(FrameStreamTest, RefusesToHearOfFramesThatItHasNotSent) {
  const auto stream = open({.credit = 1});
  publish(1);
  publish(2);
  EXPECT_EQ(fault_of(stream->acknowledge(1)).reason, "ACK_NOT_SENT");
  drain(*stream);
  EXPECT_TRUE(stream->acknowledge(2).ok());
  EXPECT_EQ(fault_of(stream->acknowledge(3)).reason, "ACK_NOT_SENT");
}

TEST_F(FrameStreamTest, HoldsOneFrameHoweverManyComeWhileItIsSlow) {
  const auto stream = open({.credit = 2});
  std::vector<std::weak_ptr<const Surface>> surfaces;
  for (std::uint64_t input = 1; input <= 50; ++input) {
    surfaces.push_back(publish(input, false, kManyVertices)->surface);
    stream->next();  // one piece of several
  }
  int alive = 0;
  for (const auto& one : surfaces) alive += one.expired() ? 0 : 1;
  EXPECT_LE(alive, 2);  // the one being sent, and the newest
}

TEST_F(FrameStreamTest, CutsALargeFrameIntoPiecesWithoutGaps) {
  const auto stream = open({.format = Format::kFloat64});
  publish(1, true, kManyVertices);
  const auto pieces = drain(*stream);
  ASSERT_GT(pieces.size(), 1u);
  std::uint32_t next = 0;
  for (const FramePiece& piece : pieces) {
    EXPECT_EQ(piece.first, next);
    EXPECT_LE(piece.count * (3 * sizeof(double) + sizeof(float)), std::size_t{1} << 20);
    next += piece.count;
    EXPECT_EQ(piece.is_last, next == kManyVertices);
  }
  EXPECT_EQ(next, kManyVertices);
}

TEST_F(FrameStreamTest, SaysSomethingAfterSilence) {
  const auto stream = open();
  EXPECT_FALSE(stream->next());
  timers_->advance(seconds(14));
  EXPECT_EQ(wakes_, 0);
  EXPECT_FALSE(stream->next());
  timers_->advance(seconds(1));
  EXPECT_GE(wakes_, 1);
  const auto note = stream->next();
  ASSERT_TRUE(note);
  EXPECT_TRUE(std::holds_alternative<HeartbeatNote>(*note));
  EXPECT_FALSE(stream->next());
}

TEST_F(FrameStreamTest, SaysOnceThatTheServerIsOverloadedAndOnceThatItIsNoMore) {
  bool is_overloaded = false;
  const auto stream =
      std::make_shared<FrameStream>(StreamOptions{.credit = 8}, publisher_, timers_, seconds(15),
                                    OpenedNote{1, 0}, [&] { return is_overloaded; });
  EXPECT_TRUE(publisher_->add(stream));
  EXPECT_TRUE(std::holds_alternative<OpenedNote>(stream->next().value()));
  EXPECT_FALSE(stream->next());
  for (const bool overloaded : {true, false}) {
    is_overloaded = overloaded;
    publish(overloaded ? 1 : 2);
    const auto note = stream->next();  // before the frame
    ASSERT_TRUE(note && std::holds_alternative<LoadNote>(*note));
    EXPECT_EQ(std::get<LoadNote>(*note).is_overloaded, overloaded);
    EXPECT_EQ(drain(*stream).size(), 1u);
  }
}

TEST_F(FrameStreamTest, HasFewTimersHoweverOftenItIsAsked) {
  const auto stream = open({.max_frames_per_second = 60});
  for (std::uint64_t input = 1; input <= 300; ++input) {
    publish(input);
    for (const FramePiece& piece : drain(*stream)) {
      EXPECT_TRUE(stream->acknowledge(piece.frame->frame_seq).ok());
    }
    timers_->advance(milliseconds(10));
  }
  EXPECT_LE(timers_->waiting(), 2u);
}

TEST_F(FrameStreamTest, KeepsToItsRateAndStillSendsTheLastFrame) {
  const auto stream = open({.credit = 8, .max_frames_per_second = 10});
  publish(1);
  EXPECT_EQ(drain(*stream).size(), 1u);
  publish(1, true);
  EXPECT_FALSE(stream->wants_frame(1));
  EXPECT_TRUE(drain(*stream).empty());
  const int wakes = wakes_;
  timers_->advance(milliseconds(99));
  EXPECT_EQ(wakes_, wakes);
  timers_->advance(milliseconds(1));
  EXPECT_GT(wakes_, wakes);
  const auto last = drain(*stream);
  ASSERT_EQ(last.size(), 1u);
  EXPECT_TRUE(last[0].frame->is_final);
}

TEST_F(FrameStreamTest, SendsAnAnswerEvenIfARefinementHasJustTakenItsPlace) {
  const auto stream = open({.credit = 8, .max_frames_per_second = 10});
  publish(1);
  EXPECT_EQ(drain(*stream).size(), 1u);
  timers_->advance(milliseconds(100));
  publish(1);
  EXPECT_EQ(drain(*stream).size(), 1u);
  publish(2);
  EXPECT_EQ(drain(*stream).size(), 1u);
  EXPECT_FALSE(stream->wants_frame(3));
}

TEST_F(FrameStreamTest, AnAnswerDoesNotWaitForTheTimerOfTheRefinementThatItReplaces) {
  const auto stream = open({.credit = 8, .max_frames_per_second = 10});
  for (const std::uint64_t input : {1, 2}) {  // both tokens
    publish(input);
    EXPECT_EQ(drain(*stream).size(), 1u);
  }
  publish(2);
  EXPECT_TRUE(drain(*stream).empty());
  publish(3);
  EXPECT_TRUE(drain(*stream).empty());
  timers_->advance(milliseconds(99));
  EXPECT_TRUE(drain(*stream).empty());
  const int wakes = wakes_;
  timers_->advance(milliseconds(1));
  EXPECT_GT(wakes_, wakes);
  EXPECT_EQ(drain(*stream).size(), 1u);
}

TEST_F(FrameStreamTest, EndsWithExactlyOneReasonAndThenIsSilent) {
  const auto stream = open();
  publish(1);
  stream->end(EndReason::kDraining, "first");
  stream->end(EndReason::kSessionDeleted, "second");
  const auto note = stream->next();
  ASSERT_TRUE(note);
  ASSERT_TRUE(std::holds_alternative<EndNote>(*note));
  EXPECT_EQ(std::get<EndNote>(*note).reason, EndReason::kDraining);
  publish(2);
  EXPECT_FALSE(stream->next());
}

TEST_F(FrameStreamTest, ShowsNoFrameOfAnOldEpoch) {
  const auto stream = open();
  publish(5, true);
  publisher_->begin_epoch(2);
  const auto pieces = drain(*stream);
  ASSERT_EQ(pieces.size(), 1u);
  EXPECT_EQ(pieces[0].frame->epoch, 2u);
  EXPECT_EQ(pieces[0].frame->input_seq, 5u);
}

TEST_F(FrameStreamTest, TellsOfAStandingFaultOnceAndNotAfterItIsGone) {
  const auto stream = open();
  publisher_->set_standing(FaultNote{absl::FailedPreconditionError("no"), 3});
  const auto note = stream->next();
  ASSERT_TRUE(note && std::holds_alternative<FaultNote>(*note));
  EXPECT_EQ(std::get<FaultNote>(*note).input_seq, 3u);
  EXPECT_FALSE(stream->next());
  publisher_->set_standing(FaultNote{absl::FailedPreconditionError("no"), 4});
  publisher_->set_standing(std::nullopt);
  EXPECT_FALSE(stream->next());
}

TEST_F(FrameStreamTest, AnswersComeBeforeFramesAndBetweenTheirPieces) {
  const auto stream = open();
  publish(1, true, kManyVertices);
  ASSERT_TRUE(std::holds_alternative<FramePiece>(stream->next().value()));
  stream->answer(UpdateResult{7, 0});
  EXPECT_EQ(stream->answers_waiting(), 1u);
  ASSERT_TRUE(std::holds_alternative<UpdateResult>(stream->next().value()));
  ASSERT_TRUE(std::holds_alternative<FramePiece>(stream->next().value()));
}

TEST_F(FrameStreamTest, AFloodOfAnswersDoesNotHoldFramesUp) {
  const auto stream = open();
  publish(1, true, kManyVertices);
  int pieces = 0;
  for (int notes = 0; notes < 8; ++notes) {
    while (stream->answers_waiting() < 2) stream->answer(UpdateResult{7, 0});
    if (std::holds_alternative<FramePiece>(stream->next().value())) ++pieces;
  }
  EXPECT_EQ(pieces, 4);
}

// 16 bytes a vertex as float32, 8 quantized, at 10 frames a second.
TEST_F(FrameStreamTest, LowersTheFrameRateFirstAndThePrecisionSecond) {
  constexpr std::uint32_t n = 1000;
  const auto format_at = [&](double bytes_per_second, Format lowest = Format::kCompressed) {
    const StreamOptions options{.lowest_format = lowest, .max_bytes_per_second = bytes_per_second};
    return options.format_for(*surface(n));
  };
  EXPECT_EQ(format_at(0), Format::kFloat32);
  EXPECT_EQ(format_at(10 * 16 * n), Format::kFloat32);
  EXPECT_EQ(format_at(10 * 16 * n - 1), Format::kQuantized);
  EXPECT_EQ(format_at(10 * 8 * n), Format::kQuantized);
  EXPECT_EQ(format_at(10 * 8 * n - 1), Format::kCompressed);
  EXPECT_EQ(format_at(1, Format::kQuantized), Format::kQuantized);
  EXPECT_EQ(format_at(1, Format::kFloat32), Format::kFloat32);
}

TEST_F(FrameStreamTest, KeepsToItsBytesASecond) {
  constexpr std::uint32_t n = 1000;
  for (const auto& [bytes_per_second, frames] : {std::pair{16e3 * 20, 20}, {16e3 * 4, 4}}) {
    const auto stream = open({.credit = 8, .max_bytes_per_second = bytes_per_second});
    int sent = 0;
    for (int k = 0; k < 1000; ++k) {
      publish(static_cast<std::uint64_t>(k) + 1, false, n);
      for (const FramePiece& piece : drain(*stream)) {
        ++sent;
        ASSERT_TRUE(stream->acknowledge(piece.frame->frame_seq).ok());
      }
      timers_->advance(milliseconds(1));
    }
    EXPECT_NEAR(sent, frames, 1);
  }
}

TEST_F(FrameStreamTest, SendsALastFrameThatItsLimitHasDelayed) {
  const auto stream = open({.max_bytes_per_second = 1000});
  publish(1);
  ASSERT_EQ(drain(*stream).size(), 1u);
  publish(2, true, 1000);
  EXPECT_TRUE(drain(*stream).empty());
  timers_->advance(seconds(1));
  const auto last = drain(*stream);
  ASSERT_EQ(last.size(), 1u);
  EXPECT_TRUE(last[0].frame->is_final);
}

TEST(Surface, HoldsBothScalarsOfEveryPosition) {
  Points points(2, 3);
  points << 0.1, 0.2, 0.3, 1e10, -2, 3;
  const Surface surface(points, Field::Constant(2, 0.7));
  const auto wide = surface.bytes(Format::kFloat64, 0, 2, true, false).positions;
  ASSERT_EQ(wide.size(), 48u);
  EXPECT_EQ(std::memcmp(wide.data(), points.data(), 48), 0);
  const auto narrow = surface.bytes(Format::kFloat32, 0, 2, true, false).positions;
  ASSERT_EQ(narrow.size(), 24u);
  float number = 0;
  std::memcpy(&number, narrow.data() + 12, sizeof(number));
  EXPECT_EQ(number, static_cast<float>(1e10));
  std::memcpy(&number, surface.bytes(Format::kFloat32, 0, 2, true, false).distortion.data(), sizeof(number));
  EXPECT_EQ(number, 0.7f);
  double wide_number = 0;
  std::memcpy(&wide_number, surface.bytes(Format::kFloat64, 0, 2, true, false).distortion.data(),
              sizeof(wide_number));
  EXPECT_EQ(wide_number, 0.7);
}

TEST(Publisher, TakesNoStreamsOnceClosed) {
  const auto timers = std::make_shared<ManualTimers>();
  const auto publisher = std::make_shared<Publisher>();
  publisher->close(EndReason::kSessionDeleted, "");
  const auto stream =
      std::make_shared<FrameStream>(StreamOptions{}, publisher, timers, seconds(15), OpenedNote{});
  EXPECT_FALSE(publisher->add(stream));
}

}  // namespace
}  // namespace lpdeform
