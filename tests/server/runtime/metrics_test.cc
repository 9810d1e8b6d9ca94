#include "server/runtime/metrics.h"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

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
        "lpdeform_input_to_frame_seconds_count 0", "lpdeform_input_to_solve_seconds_count 0",
        "lpdeform_call_queue_seconds_count 0"}) {
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

}  // namespace
}  // namespace lpdeform
