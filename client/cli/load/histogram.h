#pragma once

#include <cstdint>
#include <utility>
#include <vector>

namespace lpdeform::cli {

/// Counts of durations in microseconds, to three significant digits over all magnitudes, in the way of HdrHistogram:
/// values below 2048 have a bucket each; above, every doubling has 1024 buckets of equal width. Not thread-safe.
class Histogram {
 public:
  void record(std::uint64_t microseconds);
  void add(const Histogram& other);

  std::uint64_t count() const { return count_; }
  double mean() const;
  std::uint64_t max() const { return max_; }

  /// The smallest recorded value, to within its bucket, that `percent` of all are no larger than; 0 where there is none.
  std::uint64_t percentile(double percent) const;

  /// The buckets that are not empty: the largest value of each, and how many it has.
  std::vector<std::pair<std::uint64_t, std::uint64_t>> buckets() const;

 private:
  std::vector<std::uint64_t> counts_;
  std::uint64_t count_ = 0;
  std::uint64_t max_ = 0;
  double sum_ = 0;
};

}  // namespace lpdeform::cli
