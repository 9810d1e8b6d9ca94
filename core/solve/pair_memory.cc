#include "core/solve/pair_memory.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>

namespace lpdeform {
namespace {

constexpr std::size_t kChunk = 12288;      // numbers
constexpr double kLeastCurvature = 1e-12;  // <s, y> over |s| |y|

}  // namespace

void PairMemory::clear() {
  std::move(pairs_.begin(), pairs_.end(), std::back_inserter(spare_));
  pairs_.clear();
}

/// Adds up body(begin, end) over chunks of `count` numbers, in their order.
template <typename Body>
double PairMemory::sum(std::size_t count, const Body& body) {
  chunk_sums_.assign((count + kChunk - 1) / kChunk, 0.0);
  workers_.for_chunks(count, kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    chunk_sums_[chunk] = body(begin, end);
  });
  return std::accumulate(chunk_sums_.begin(), chunk_sums_.end(), 0.0);
}

void PairMemory::remember(const Points& x, const Points& x_before, const Points& gradient,
                          const Points& gradient_before) {
  Pair pair;
  if (!spare_.empty()) {
    pair = std::move(spare_.back());
    spare_.pop_back();
  }
  pair.s.resize(x.rows(), 3);
  pair.y.resize(x.rows(), 3);
  const auto count = static_cast<std::size_t>(x.size());
  const auto dot = [&](const Points& a, const Points& b) {
    return sum(count, [&](std::size_t begin, std::size_t end) {
      return std::inner_product(a.data() + begin, a.data() + end, b.data() + begin, 0.0);
    });
  };
  const double curvature = sum(count, [&](std::size_t begin, std::size_t end) {
    double chunk = 0;
    for (std::size_t k = begin; k < end; ++k) {
      const double s = x.data()[k] - x_before.data()[k], y = gradient.data()[k] - gradient_before.data()[k];
      pair.s.data()[k] = s;
      pair.y.data()[k] = y;
      chunk += s * y;
    }
    return chunk;
  });
  const double size = std::sqrt(dot(pair.s, pair.s)) * std::sqrt(dot(pair.y, pair.y));
  if (!(curvature > kLeastCurvature * size)) return spare_.push_back(std::move(pair));
  pair.rho = 1 / curvature;
  pairs_.push_back(std::move(pair));
  if (pairs_.size() <= most_pairs_) return;
  spare_.push_back(std::move(pairs_.front()));
  pairs_.pop_front();
}

/// d += factor * added; returns <d, other>, 0 where that is null.
double PairMemory::add_and_dot(double factor, const Points& added, const Points* other, Points& d) {
  return sum(static_cast<std::size_t>(d.size()), [&](std::size_t begin, std::size_t end) {
    double* const to = d.data();
    const double* const from = added.data();
    for (std::size_t k = begin; k < end; ++k) to[k] += factor * from[k];
    return other == nullptr ? 0.0 : std::inner_product(to + begin, to + end, other->data() + begin, 0.0);
  });
}

double PairMemory::direction(const Points& gradient, const std::function<void(Points&)>& metric, Points& d) {
  const std::size_t m = pairs_.size();
  std::vector<double> alpha(m);
  d.setZero(gradient.rows(), 3);
  double next = add_and_dot(-1, gradient, m > 0 ? &pairs_[m - 1].s : nullptr, d);
  for (std::size_t k = m; k-- > 0;) {
    alpha[k] = pairs_[k].rho * next;
    next = add_and_dot(-alpha[k], pairs_[k].y, k > 0 ? &pairs_[k - 1].s : nullptr, d);
  }
  metric(d);
  next = add_and_dot(0, gradient, m > 0 ? &pairs_[0].y : &gradient, d);
  for (std::size_t k = 0; k < m; ++k) {
    const double beta = pairs_[k].rho * next;
    next = add_and_dot(alpha[k] - beta, pairs_[k].s, k + 1 < m ? &pairs_[k + 1].y : &gradient, d);
  }
  return next;
}

}  // namespace lpdeform
