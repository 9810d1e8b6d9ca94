#include "client/cli/load/histogram.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>

namespace lpdeform::cli {
namespace {

constexpr int kBits = 11;                                    // bits of resolution
constexpr std::uint64_t kExact = std::uint64_t{1} << kBits;  // below this, every value has its own bucket
constexpr std::uint64_t kHalf = kExact / 2;

std::size_t bucket_of(std::uint64_t value) {
  if (value < kExact) return value;
  const int shift = std::bit_width(value) - kBits;
  return kExact + static_cast<std::size_t>(shift - 1) * kHalf + ((value >> shift) - kHalf);
}

std::uint64_t largest_of(std::size_t bucket) {
  if (bucket < kExact) return bucket;
  const std::size_t above = bucket - kExact;
  const auto shift = static_cast<int>(above / kHalf) + 1;
  return ((above % kHalf + kHalf + 1) << shift) - 1;
}

}  // namespace

void Histogram::record(std::uint64_t microseconds) {
  const std::size_t bucket = bucket_of(microseconds);
  if (bucket >= counts_.size()) counts_.resize(bucket + 1);
  ++counts_[bucket];
  ++count_;
  max_ = std::max(max_, microseconds);
  sum_ += static_cast<double>(microseconds);
}

void Histogram::add(const Histogram& other) {
  if (other.counts_.size() > counts_.size()) counts_.resize(other.counts_.size());
  for (std::size_t k = 0; k < other.counts_.size(); ++k) counts_[k] += other.counts_[k];
  count_ += other.count_;
  max_ = std::max(max_, other.max_);
  sum_ += other.sum_;
}

double Histogram::mean() const {
  return count_ == 0 ? 0 : sum_ / static_cast<double>(count_);
}

std::uint64_t Histogram::percentile(double percent) const {
  const auto wanted = static_cast<std::uint64_t>(std::ceil(percent / 100 * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (std::size_t k = 0; k < counts_.size(); ++k) {
    seen += counts_[k];
    if (seen >= std::max<std::uint64_t>(wanted, 1)) return std::min(largest_of(k), max_);
  }
  return 0;
}

std::vector<std::pair<std::uint64_t, std::uint64_t>> Histogram::buckets() const {
  std::vector<std::pair<std::uint64_t, std::uint64_t>> filled;
  for (std::size_t k = 0; k < counts_.size(); ++k) {
    if (counts_[k] != 0) filled.emplace_back(largest_of(k), counts_[k]);
  }
  return filled;
}

}  // namespace lpdeform::cli
