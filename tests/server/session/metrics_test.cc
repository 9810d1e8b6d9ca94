#include "server/runtime/metrics.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "bar.h"
#include "manual_timers.h"
#include "server/session/publisher.h"

namespace lpdeform {
namespace {

bool has_line(const Metrics& metrics, const std::string& line) {
  return metrics.text().find("\n" + line + "\n") != std::string::npos;
}

TEST(Metrics, EveryCountLevelAndSpanIsThereFromTheBeginning) {
  const Metrics metrics;
  for (const char* const name :
       {"lpdeform_updates_total 0", "lpdeform_updates_coalesced_total 0", "lpdeform_frames_published_total 0",
        "lpdeform_frames_sent_total 0", "lpdeform_frames_superseded_total 0", "lpdeform_frame_bytes_total 0",
        "lpdeform_credit_stalls_total 0", "lpdeform_sessions_created_total 0", "lpdeform_draining 0",
        "lpdeform_input_to_frame_seconds_count 0", "lpdeform_call_queue_seconds_count 0"}) {
    EXPECT_TRUE(has_line(metrics, name)) << name;
  }
}

TEST(Metrics, AddsUpOverThreads) {
  Metrics metrics;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int k = 0; k < 1000; ++k) {
        metrics.add(Count::kFramesSent);
        metrics.observe(Span::kSolve, 0.25);
        metrics.rejected("MEMORY_FULL");
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_TRUE(has_line(metrics, "lpdeform_frames_sent_total 4000"));
  EXPECT_TRUE(has_line(metrics, "lpdeform_solve_seconds_sum 1000"));
  EXPECT_TRUE(has_line(metrics, "lpdeform_rejections_total{reason=\"MEMORY_FULL\"} 4000"));
}

/// A frame_seq a second, of which a reader with a credit of 1 takes only some.
TEST(Metrics, AReaderThatWaitsForCreditStallsOnceAndMissesFrames) {
  const auto metrics = std::make_shared<Metrics>();
  const auto publisher = std::make_shared<Publisher>(metrics);
  const auto timers = std::make_shared<ManualTimers>();
  const auto shape = shape_of(bar_mesh());
  const auto mesh = std::make_shared<const DrawMesh>(shape);
  const auto stream = std::make_shared<FrameStream>(StreamOptions{.credit = 1}, publisher, timers,
                                                    std::chrono::seconds(15), OpenedNote{});
  ASSERT_TRUE(publisher->add(stream));
  const auto publish = [&](std::uint64_t input_seq) {
    Frame frame;
    frame.input_seq = input_seq;
    frame.surface = std::make_shared<Surface>(mesh->positions(shape->positions()),
                                              Field::Zero(shape->vertex_count()), mesh);
    publisher->publish(std::move(frame));
    while (stream->next()) {
    }
  };
  publisher->took(1, std::chrono::steady_clock::now());
  for (const std::uint64_t input_seq : {1, 2, 3, 4}) publish(input_seq);  // the first goes out, the rest wait
  EXPECT_TRUE(has_line(*metrics, "lpdeform_credit_stalls_total 1"));
  ASSERT_TRUE(stream->acknowledge(1).ok());
  while (stream->next()) {
  }
  EXPECT_TRUE(has_line(*metrics, "lpdeform_frames_published_total 4"));
  EXPECT_TRUE(has_line(*metrics, "lpdeform_frames_sent_total 2"));
  EXPECT_TRUE(has_line(*metrics, "lpdeform_frames_superseded_total 2"));
  EXPECT_TRUE(has_line(*metrics, "lpdeform_input_to_frame_seconds_count 1"));
}

}  // namespace
}  // namespace lpdeform
