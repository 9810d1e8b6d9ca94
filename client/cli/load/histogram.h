#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace lpdeform::cli {

/// Counts durations in microseconds, with three significant digits at all magnitudes, like HdrHistogram.
/// Values below 2048 have a bucket each. Above that, each power of two has 1024 buckets of equal width. Not
/// thread-safe.
class Histogram {
 public:
  void record(std::uint64_t microseconds);
  void add(const Histogram& other);

  std::uint64_t count() const { return count_; }
  double mean() const;
  std::uint64_t max() const { return max_; }

  /// The smallest recorded value such that `percent` of all values are not larger, to within its bucket; 0 if
  /// nothing is recorded.
  std::uint64_t percentile(double percent) const;

  /// The buckets that are not empty: the largest value of each, and its count.
  std::vector<std::pair<std::uint64_t, std::uint64_t>> buckets() const;

 private:
  std::vector<std::uint64_t> counts_;
  std::uint64_t count_ = 0;
  std::uint64_t max_ = 0;
  double sum_ = 0;
};

}  // namespace lpdeform::cli
