#include "server/upload_bytes.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <random>
#include <set>
#include <string>

namespace lpdeform {
namespace {

constexpr std::uint64_t kStep = UploadBytes::kStep;

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
  EXPECT_EQ(bytes.memory_with(kStep - 1, 2), 2 * kStep);
  EXPECT_EQ(bytes.memory_with(3 * kStep + 4, 1), kStep + 5);
  ASSERT_TRUE(bytes.put(3 * kStep, "ends"));
  EXPECT_EQ(bytes.memory(), kStep + 5);
  EXPECT_EQ(bytes.memory_with(0, bytes.size()), bytes.size());
}

TEST(UploadBytes, AByteAtTheEndOfManyGigabytesTakesOneStep) {
  constexpr std::uint64_t kSize = std::uint64_t{4} << 30;
  UploadBytes bytes(kSize);
  const std::size_t before = resident();
  ASSERT_TRUE(bytes.put(kSize - 1, "x"));
  ASSERT_TRUE(bytes.put(kSize / 2, "y"));
  EXPECT_EQ(bytes.memory(), 2 * kStep);
  EXPECT_LT(resident() - before, 16 * kStep);
  EXPECT_EQ(bytes.whole().size(), kSize);
  EXPECT_EQ(bytes.whole().back(), 'x');
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
    const std::uint64_t memory = steps.size() * kStep - (steps.contains(9) ? kStep - 1234 : 0);
    ASSERT_EQ(bytes.memory_with(begin, count), memory);
    ASSERT_TRUE(bytes.put(begin, part));
    ASSERT_EQ(bytes.memory(), memory);
    ASSERT_EQ(bytes.received(), there.size());
  }
  EXPECT_TRUE(bytes.whole() == expected);
  bytes.clear();
  EXPECT_EQ(bytes.memory() + bytes.received() + bytes.runs(), 0u);
  ASSERT_TRUE(bytes.put(0, "again"));
  EXPECT_EQ(bytes.whole().substr(0, 6), std::string_view("again\0", 6));
}

}  // namespace
}  // namespace lpdeform
