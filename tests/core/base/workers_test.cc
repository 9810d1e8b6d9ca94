#include "core/base/workers.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cfenv>
#include <chrono>
#include <new>
#include <thread>
#include <vector>

namespace lpdeform {
namespace {

using Counts = std::vector<std::atomic<int>>;

bool all_are(const Counts& counts, int expected) {
  for (const std::atomic<int>& count : counts) {
    if (count != expected) return false;
  }
  return true;
}

TEST(Workers, RunsEachChunkOnce) {
  for (const int threads : {1, 2, 5}) {
    Counts counts(4);
    std::array<std::array<std::size_t, 2>, 4> ranges{};
    Workers(threads).for_chunks(10, 3, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
      ++counts[chunk];
      ranges[chunk] = {begin, end};
    });
    const std::array<std::array<std::size_t, 2>, 4> expected{{{0, 3}, {3, 6}, {6, 9}, {9, 10}}};
    EXPECT_EQ(ranges, expected) << threads;
    EXPECT_TRUE(all_are(counts, 1)) << threads;
  }
}

TEST(Workers, RunsNothingForNothing) {
  for (const int threads : {1, 2}) {
    Workers(threads).for_chunks(
        0, 3, [](std::size_t, std::size_t, std::size_t) { FAIL() << "a chunk of nothing"; });
  }
}

// Each function waits until the other one has begun.
TEST(Workers, RunsBothAtTheSameTime) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  std::atomic<int> begun = 0, met = 0;
  const auto meet = [&] {
    for (++begun; begun < 2 && std::chrono::steady_clock::now() < deadline;) std::this_thread::yield();
    if (begun == 2) ++met;
  };
  Workers(2).run_both(meet, meet);
  EXPECT_EQ(met, 2);
}

TEST(Workers, RunsLoopsInsideLoops) {
  const Workers outer(4), inner(3);
  Counts counts(6 * 50);
  outer.for_chunks(6, 1, [&](std::size_t chunk, std::size_t, std::size_t) {
    inner.for_chunks(50, 1,
                     [&](std::size_t, std::size_t begin, std::size_t) { ++counts[50 * chunk + begin]; });
  });
  EXPECT_TRUE(all_are(counts, 1));
}

// While a thread waits for an inner loop, it begins no other chunk of the outer one. Otherwise a chunk could have to wait for another one
// to end.
TEST(Workers, AChunkIsNotBegunInsideAnother) {
  const Workers workers(4);
  static thread_local int depth = 0;
  std::atomic<int> deepest = 0;
  for (int loop = 0; loop < 30; ++loop) {
    workers.for_chunks(64, 1, [&](std::size_t, std::size_t, std::size_t) {
      ++depth;
      for (int before = deepest; depth > before && !deepest.compare_exchange_weak(before, depth);) {
      }
      workers.for_chunks(4, 1, [](std::size_t k, std::size_t, std::size_t) {
        std::this_thread::sleep_for(std::chrono::microseconds(50 * k));
      });
      --depth;
    });
  }
  EXPECT_EQ(deepest, 1);
}

TEST(Workers, RunsLoopsOfSeveralThreads) {
  constexpr int kLoops = 200;
  Counts counts(100);
  std::vector<std::thread> callers;
  const Workers workers(3);
  for (int caller = 0; caller < 4; ++caller) {
    callers.emplace_back([&counts, &workers] {
      for (int loop = 0; loop < kLoops; ++loop) {
        workers.for_chunks(counts.size(), 7, [&](std::size_t, std::size_t begin, std::size_t end) {
          for (; begin < end; ++begin) ++counts[begin];
        });
      }
    });
  }
  for (std::thread& caller : callers) caller.join();
  EXPECT_TRUE(all_are(counts, 4 * kLoops));
}

int settings_in_chunks(const Workers& workers) {
  std::atomic<int> result = std::fegetround();
  workers.for_chunks(64, 1, [&](std::size_t, std::size_t, std::size_t) {
    std::this_thread::sleep_for(std::chrono::microseconds(20));
    if (std::fegetround() != result) result = -1;
  });
  return result;
}

// A program may have other settings in one thread, for example a game engine.
TEST(Workers, ALoopHasTheFloatingPointSettingsOfItsCaller) {
  const Workers workers(3);
  const int before = std::fegetround();
  std::thread([&] {
    std::fesetround(FE_UPWARD);
    EXPECT_EQ(settings_in_chunks(workers), FE_UPWARD);
  }).join();
  EXPECT_EQ(settings_in_chunks(workers), before);
}

// The next loop still has its own threads, more than there are cores.
TEST(Workers, AChunkThatThrowsLeavesTheNextLoopAsItWas) {
  const int several = available_cores() + 2;
  const Workers workers(several);
  EXPECT_THROW(
      workers.for_chunks(8, 1, [](std::size_t, std::size_t, std::size_t) { throw std::bad_alloc(); }),
      std::bad_alloc);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  std::atomic<int> begun = 0;
  workers.for_chunks(static_cast<std::size_t>(several), 1, [&](std::size_t, std::size_t, std::size_t) {
    for (++begun; begun < several && std::chrono::steady_clock::now() < deadline;) std::this_thread::yield();
  });
  EXPECT_EQ(begun, several);
  EXPECT_LT(std::chrono::steady_clock::now(), deadline);
}

}  // namespace
}  // namespace lpdeform
