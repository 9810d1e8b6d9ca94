#include "client/cli/load/histogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace lpdeform::cli {
namespace {

TEST(Histogram, IsEmptyInTheBeginning) {
  const Histogram histogram;
  EXPECT_EQ(histogram.count(), 0u);
  EXPECT_EQ(histogram.mean(), 0);
  EXPECT_EQ(histogram.percentile(99), 0u);
  EXPECT_TRUE(histogram.buckets().empty());
}

TEST(Histogram, KeepsSmallValuesExactly) {
  Histogram histogram;
  for (std::uint64_t value = 0; value <= 2000; ++value) histogram.record(value);
  EXPECT_EQ(histogram.percentile(50), 1000u);
  EXPECT_EQ(histogram.percentile(100), 2000u);
  EXPECT_EQ(histogram.percentile(0), 0u);
  EXPECT_DOUBLE_EQ(histogram.mean(), 1000);
}

/// A bucket is a 1024th of its values wide at most.
TEST(Histogram, PercentilesOfAllMagnitudesAreThoseOfTheSortedValues) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> magnitude(0, 31);
  Histogram histogram, one_half, other_half;
  std::vector<std::uint64_t> values;
  for (int k = 0; k < 20000; ++k) {
    values.push_back(static_cast<std::uint64_t>(std::exp(magnitude(random) * std::log(2.0))));
    histogram.record(values.back());
    (k % 2 == 0 ? one_half : other_half).record(values.back());
  }
  std::sort(values.begin(), values.end());
  one_half.add(other_half);
  for (const double percent : {1.0, 25.0, 50.0, 90.0, 99.0, 99.9, 100.0}) {
    const auto rank = static_cast<std::size_t>(std::ceil(percent / 100 * 20000)) - 1;
    const auto exact = static_cast<double>(values[rank]);
    EXPECT_GE(static_cast<double>(histogram.percentile(percent)), exact) << percent;
    EXPECT_LE(static_cast<double>(histogram.percentile(percent)), exact * (1 + 1.0 / 1024)) << percent;
    EXPECT_EQ(one_half.percentile(percent), histogram.percentile(percent)) << percent;
  }
  EXPECT_EQ(histogram.max(), values.back());
  std::uint64_t counted = 0;
  for (const auto& [value, count] : histogram.buckets()) counted += count;
  EXPECT_EQ(counted, 20000u);
}

TEST(Histogram, TakesTheLongestDuration) {
  Histogram histogram;
  const std::uint64_t century = 100ull * 365 * 24 * 3600 * 1'000'000;
  histogram.record(century);
  EXPECT_EQ(histogram.percentile(50), century);
}

}  // namespace
}  // namespace lpdeform::cli
