#include "core/methods/lbfgs_memory.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace lpdeform {
namespace {

constexpr std::size_t kChunk = 12288;      // numbers
constexpr double kLeastCurvature = 1e-12;  // the least <s, y> / (|s| |y|)
constexpr double kLeastGamma = 0.05, kMostGamma = 4;

}  // namespace

std::vector<KeptPair> LbfgsMemory::kept() const {
  std::vector<KeptPair> result;
  for (const Pair& pair : pairs_) result.push_back({pair.s.data(), pair.z.data()});
  return result;
}

/// The sums of sweep_products over all chunks, added in chunk order.
std::vector<double> LbfgsMemory::products(const Points& gradient, const Points& gradient_before,
                                          const SinglePoints& h, double length, const Points& d) {
  const auto count = static_cast<std::size_t>(gradient.size());
  candidate_.s.resize(gradient.rows(), 3);
  const NewPair pair{gradient.data(), gradient_before.data(), h.data(),           d.data(),
                     length,          candidate_.s.data(),    candidate_.z.data()};
  const std::vector<KeptPair> old = kept();
  const std::size_t width = kSumsBefore + kSumsOfPair * (old.size() + 1);
  chunk_sums_.assign((count + kChunk - 1) / kChunk * width, 0.0);
  workers_.for_chunks(count, kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    sweep_products(pair, old, begin, end, chunk_sums_.data() + chunk * width);
  });
  std::vector<double> sums(width, 0.0);
  for (std::size_t k = 0; k < chunk_sums_.size(); ++k) sums[k % width] += chunk_sums_[k];
  return sums;
}

/// Drops the oldest pair if there is no room for another one. The next pair takes its memory.
void LbfgsMemory::drop_oldest() {
  if (pairs_.size() < most_pairs_) return;
  candidate_ = std::move(pairs_.front());
  pairs_.erase(pairs_.begin());
  for (Pair& younger : pairs_) {
    younger.sy.erase(younger.sy.begin());
    younger.zy.erase(younger.zy.begin());
  }
}

/// Stores the candidate.
void LbfgsMemory::take_in(const std::vector<double>& sums) {
  Pair pair = std::move(candidate_);
  pair.sy.clear();
  pair.zy.clear();
  for (std::size_t at = kSumsBefore; at < sums.size(); at += kSumsOfPair) {
    pair.sy.push_back(sums[at + 2]);
    pair.zy.push_back(sums[at + 3]);
  }
  pairs_.push_back(std::move(pair));
}

double LbfgsMemory::direction(const Points& gradient, const Points& gradient_before, SinglePoints& h,
                              double length, Points& d) {
  if (length == 0) {
    d = -gamma_ * h.cast<double>();
    candidate_.z.swap(h);
    return gradient.cwiseProduct(d).sum();
  }
  const std::vector<double> sums = products(gradient, gradient_before, h, length, d);
  const double curvature = sums[sums.size() - 2];
  const double size = length * std::sqrt(sums[0]) * std::sqrt(sums[1]);
  if (curvature > kLeastCurvature * size) take_in(sums);

  const std::size_t m = pairs_.size();
  if (m > 0) gamma_ = std::clamp(pairs_.back().sy.back() / pairs_.back().zy.back(), kLeastGamma, kMostGamma);
  const auto sg = [&](std::size_t i) { return sums[kSumsBefore + kSumsOfPair * i]; };
  const auto zg = [&](std::size_t i) { return sums[kSumsBefore + kSumsOfPair * i + 1]; };
  std::vector<double> a(m), b(m);
  for (std::size_t i = m; i-- > 0;) {  // R a = S^T g
    a[i] = sg(i);
    for (std::size_t j = i + 1; j < m; ++j) a[i] -= pairs_[j].sy[i] * a[j];
    a[i] /= pairs_[i].sy[i];
  }
  for (std::size_t i = 0; i < m; ++i) {  // R^T b = (D + gamma W) a - gamma Z^T g
    b[i] = pairs_[i].sy[i] * a[i] - gamma_ * zg(i);
    for (std::size_t j = 0; j < m; ++j) b[i] += gamma_ * pairs_[std::max(i, j)].zy[std::min(i, j)] * a[j];
    for (std::size_t j = 0; j < i; ++j) b[i] -= pairs_[i].sy[j] * b[j];
    b[i] /= pairs_[i].sy[i];
  }
  double slope = -gamma_ * sums[2];
  for (std::size_t i = 0; i < m; ++i) {
    a[i] *= -gamma_;
    slope -= a[i] * zg(i) + b[i] * sg(i);
  }

  const std::vector<KeptPair> all = kept();
  d.resize(gradient.rows(), 3);
  workers_.for_chunks(static_cast<std::size_t>(d.size()), kChunk,
                      [&](std::size_t, std::size_t begin, std::size_t end) {
                        sweep_direction(gamma_, h.data(), all, b.data(), a.data(), begin, end, d.data());
                      });
  drop_oldest();
  candidate_.z.swap(h);
  return slope;
}

}  // namespace lpdeform
