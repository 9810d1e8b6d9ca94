#include "server/runtime/upload_bytes.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace lpdeform {
namespace {

constexpr std::uint64_t kStep = UploadBytes::kStep, kPage = UploadBytes::kPage, kRun = UploadBytes::kRunBytes;

/// Of this process, in bytes.
std::size_t resident() {
  std::size_t all = 0, in_memory = 0;
  std::ifstream("/proc/self/statm") >> all >> in_memory;
  return in_memory * static_cast<std::size_t>(sysconf(_SC_PAGE_SIZE));
}

TEST(UploadBytes, TakeMemoryByStepsAsTheyCome) {
  UploadBytes bytes(3 * kStep + 5);
  EXPECT_EQ(bytes.memory(), 0u);
  EXPECT_EQ(bytes.memory_with(0, 1), kStep);
  ASSERT_TRUE(bytes.put(7, "x"));
  EXPECT_EQ(bytes.memory(), kStep);
  EXPECT_EQ(bytes.memory_with(0, kStep), kStep);
  EXPECT_EQ(bytes.memory_with(kStep - 1, 2), 2 * kStep + kRun);
  EXPECT_EQ(bytes.memory_with(3 * kStep + 4, 1), kStep + kPage + kRun);
  ASSERT_TRUE(bytes.put(3 * kStep, "ends"));
  EXPECT_EQ(bytes.memory(), kStep + kPage + kRun);
  EXPECT_EQ(bytes.memory_with(0, bytes.size()), 3 * kStep + kPage);
}

TEST(UploadBytes, AByteAtTheEndOfManyGigabytesTakesOneStep) {
  constexpr std::uint64_t kSize = std::uint64_t{4} << 30;
  UploadBytes bytes(kSize);
  const std::size_t before = resident();
  ASSERT_TRUE(bytes.put(kSize - 1, "x"));
  ASSERT_TRUE(bytes.put(kSize / 2, "y"));
  EXPECT_EQ(bytes.memory(), 2 * kStep + kRun);
  EXPECT_LT(resident() - before, 16 * kStep);
  EXPECT_EQ(bytes.whole().size(), kSize);
  EXPECT_EQ(bytes.whole().back(), 'x');
}

TEST(UploadBytes, InTinyPartsTakeNoMoreThanIsCounted) {
  constexpr std::size_t kRuns = 1024, kMany = 100;
  std::vector<std::unique_ptr<UploadBytes>> all;
  std::size_t counted = 0;
  const std::size_t before = resident();
  for (std::size_t k = 0; k < kMany; ++k) {
    all.push_back(std::make_unique<UploadBytes>(2 * kRuns));
    for (std::size_t run = 0; run < kRuns; ++run) ASSERT_TRUE(all.back()->put(2 * run, "x"));
    EXPECT_EQ(all.back()->memory(), kPage + (kRuns - 1) * kRun);
    counted += all.back()->memory();
  }
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // they take memory of their own
  EXPECT_LT(resident() - before, counted + (1 << 20));
#endif
  for (std::size_t run = 0; run + 1 < kRuns; ++run) ASSERT_TRUE(all[0]->put(2 * run + 1, "y"));
  EXPECT_EQ(all[0]->memory(), kPage);
}

TEST(UploadBytes, OfASizeThatNoMachineHasTakeNothing) {
  UploadBytes bytes(~std::uint64_t{0} / 2);
  EXPECT_FALSE(bytes.put(bytes.size() - 1, "x"));
  EXPECT_EQ(bytes.memory(), 0u);
  EXPECT_EQ(bytes.received(), 0u);
}

TEST(UploadBytes, WhateverTheOrderAreThoseThatCameAndCountTheStepsThatTheyAreIn) {
  std::mt19937 random(7);
  const std::uint64_t size = 9 * kStep + 1234;
  UploadBytes bytes(size);
  std::string expected(size, '\0');
  std::set<std::uint64_t> steps, there;
  for (int k = 0; k < 400; ++k) {
    const std::uint64_t begin = random() % size;
    const std::uint64_t count =
        1 + random() % std::min<std::uint64_t>(size - begin, k % 20 == 0 ? kStep : 300);
    const std::string part(count, static_cast<char>('a' + k % 26));
    for (std::uint64_t at = begin; at < begin + count; ++at) {
      steps.insert(at / kStep);
      there.insert(at);
    }
    expected.replace(begin, count, part);
    const std::uint64_t with_it = bytes.memory_with(begin, count);
    ASSERT_TRUE(bytes.put(begin, part));
    const std::uint64_t pages = steps.size() * kStep - (steps.contains(9) ? kStep - kPage : 0);
    ASSERT_EQ(bytes.memory(), pages + (bytes.runs() - 1) * kRun);
    ASSERT_EQ(with_it, bytes.memory());
    ASSERT_EQ(bytes.received(), there.size());
  }
  EXPECT_TRUE(bytes.whole() == expected);
  const auto ends =
      std::count_if(there.begin(), there.end(), [&](auto at) { return !there.contains(at + 1); });
  EXPECT_EQ(bytes.runs(), static_cast<std::size_t>(ends));
  bytes.clear();
  EXPECT_EQ(bytes.memory() + bytes.received() + bytes.runs(), 0u);
  ASSERT_TRUE(bytes.put(0, "again"));
  EXPECT_EQ(bytes.whole().substr(0, 6), std::string_view("again\0", 6));
}

}  // namespace
}  // namespace lpdeform
