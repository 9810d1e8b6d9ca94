#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <vector>

#include "core/base/geometry.h"
#include "core/base/workers.h"

namespace lpdeform {

/// The memory of L-BFGS: the last pairs s = x' - x, y = g' - g of steps and changes of the gradient, and the
/// product of the inverse Hessian that they stand for (Nocedal & Wright, algorithm 7.4). Runs in parallel in
/// fixed chunks: the same bits on any number of threads. One caller at a time.
class PairMemory {
 public:
  PairMemory(Workers workers, std::size_t most_pairs)
      : workers_(std::move(workers)), most_pairs_(most_pairs) {}

  void clear();

  /// Remembers a step and its change of the gradient; not where their product is not positive to rounding.
  void remember(const Points& x, const Points& x_before, const Points& gradient,
                const Points& gradient_before);

  /// d = -H g, with `metric` for H_0: it replaces its argument by H_0 times that. Returns <g, d>.
  double direction(const Points& gradient, const std::function<void(Points&)>& metric, Points& d);

 private:
  struct Pair {
    Points s, y;
    double rho = 0;  // 1 / <s, y>
  };
  template <typename Body>
  double sum(std::size_t count, const Body& body);
  double add_and_dot(double factor, const Points& added, const Points* other, Points& d);

  Workers workers_;
  const std::size_t most_pairs_;
  std::deque<Pair> pairs_;   // oldest first
  std::vector<Pair> spare_;  // memory of forgotten ones
  std::vector<double> chunk_sums_;
};

}  // namespace lpdeform
