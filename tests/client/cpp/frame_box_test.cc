#include "client/cpp/frame_box.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "absl/status/status.h"

namespace lpdeform::client {
namespace {

Frame frame(std::uint64_t epoch, std::uint64_t frame_seq, std::uint64_t input_seq,
            std::uint64_t skipped = 0) {
  Frame frame;
  frame.epoch = epoch;
  frame.frame_seq = frame_seq;
  frame.input_seq = input_seq;
  frame.skipped_inputs = skipped;
  return frame;
}

absl::StatusOr<std::optional<FrameBox::Taken>> take_now(FrameBox& box) {
  return box.take(FrameBox::Clock::now());
}

TEST(FrameBox, KeepsTheNewestFrameAlone) {
  FrameBox box;
  EXPECT_TRUE(box.put(frame(1, 1, 1), 1));
  EXPECT_TRUE(box.put(frame(1, 2, 1), 1));
  const auto taken = take_now(box);
  ASSERT_TRUE(taken.ok() && taken->has_value());
  EXPECT_EQ((*taken)->frame.frame_seq, 2u);
  EXPECT_FALSE(take_now(box)->has_value());
}

TEST(FrameBox, WaitsForNewsAndTakesNothing) {
  FrameBox box;
  const auto far = FrameBox::Clock::now() + std::chrono::minutes(10);
  EXPECT_FALSE(box.wait(FrameBox::Clock::now()));
  std::thread later([&] { box.put(frame(1, 1, 1), 1); });
  EXPECT_TRUE(box.wait(far));
  later.join();
  EXPECT_TRUE(box.wait(far));
  EXPECT_TRUE(take_now(box)->has_value());
  EXPECT_FALSE(box.wait(FrameBox::Clock::now()));
  box.put_problem(absl::InternalError("something"));
  EXPECT_TRUE(box.wait(far));
  EXPECT_FALSE(take_now(box).ok());
  box.finish(absl::CancelledError("over"));
  EXPECT_TRUE(box.wait(far));
}

TEST(FrameBox, AddsUpTheInputsThatReplacedFramesSkipped) {
  FrameBox box;
  box.put(frame(1, 1, 3, 2), 1);
  box.put(frame(1, 2, 6, 1), 1);
  EXPECT_EQ((*take_now(box))->frame.skipped_inputs, 3u);
}

TEST(FrameBox, DropsFramesOfAnEpochThatIsOver) {
  FrameBox box;
  box.put(frame(2, 9, 1), 1);
  box.begin_epoch(3);
  EXPECT_FALSE(take_now(box)->has_value());
  EXPECT_FALSE(box.put(frame(2, 10, 2), 1));
  EXPECT_TRUE(box.put(frame(3, 1, 2), 1));
}

TEST(FrameBox, DropsFramesOfAnOlderInput) {
  FrameBox box;
  EXPECT_TRUE(box.put(frame(1, 5, 7), 1));
  box.begin_session();
  EXPECT_FALSE(box.put(frame(1, 1, 0), 2));
  EXPECT_TRUE(box.put(frame(1, 2, 7), 2));
}

TEST(FrameBox, HandsOutEachProblemOnceAndBeforeFrames) {
  FrameBox box;
  box.put(frame(1, 1, 1), 1);
  box.put_problem(absl::InvalidArgumentError("first"));
  box.put_problem(absl::InvalidArgumentError("second"));
  EXPECT_EQ(take_now(box).status().message(), "first");
  EXPECT_EQ(take_now(box).status().message(), "second");
  EXPECT_TRUE(take_now(box)->has_value());
}

TEST(FrameBox, KeepsTheNewestProblemsWhereNobodyTakesThem) {
  FrameBox box;
  for (std::size_t k = 0; k <= FrameBox::kMostProblems; ++k) {
    box.put_problem(absl::InvalidArgumentError(std::to_string(k)));
  }
  EXPECT_EQ(take_now(box).status().message(), "1");
}

TEST(FrameBox, HandsOutTheLastFrameBeforeItSaysWhyItIsOver) {
  FrameBox box;
  box.put(frame(1, 1, 1), 1);
  box.finish(absl::AbortedError("replaced"));
  EXPECT_TRUE(take_now(box)->has_value());
  EXPECT_TRUE(absl::IsAborted(take_now(box).status()));
  EXPECT_TRUE(absl::IsAborted(take_now(box).status()));
  box.resume();
  EXPECT_TRUE(take_now(box).ok());
}

}  // namespace
}  // namespace lpdeform::client
