#pragma once

#include <cstddef>
#include <vector>

#include "core/base/geometry.h"
#include "core/base/workers.h"
#include "core/methods/pair_sweeps.h"

namespace lpdeform {

/// The memory of L-BFGS and its inverse Hessian H in compact form (Byrd, Nocedal & Schnabel 1994, theorem 2.2):
///
///   H g = gamma h + S R^-T ((D + gamma W) a - gamma Z^T g) - gamma Z a,   a = R^-1 S^T g,   h = M^-1 g
///
/// with M the metric, columns s = x' - x and z = M^-1 y = h' - h of S and Z, y = g' - g, R the upper triangle of
/// S^T Y, D its diagonal, W = Z^T Y. H_0 = gamma M^-1 with gamma = <s, y> / <z, y> of the newest pair (Nocedal &
/// Wright, 7.20), between 0.05 and 4: for p > 2 the metric lacks the curvature along the residuals, (p - 1) times as
/// much, and full steps would be too long; where rotations follow a step, it has more than there is, and full steps
/// would be about half as long as they should. It outlives clear().
///
/// All vectors are swept over twice an iteration and no more. Pairs are kept in single precision: they only steer.
/// Runs in parallel in fixed chunks: the same bits on any number of threads. One caller at a time.
class PairMemory {
 public:
  PairMemory(Workers workers, std::size_t most_pairs)
      : workers_(std::move(workers)), most_pairs_(most_pairs) {}

  /// Forgets all pairs: M has changed.
  void clear() { pairs_.clear(); }
  bool is_empty() const { return pairs_.empty(); }

  /// d = -H g; returns <g, d>. `length` > 0 says that the step length * d has been made since the last call, when
  /// gradient and h were those before: the pair is taken in, unless <s, y> is not positive to rounding. 0 where
  /// there was none, or clear() came between.
  double direction(const Points& gradient, const Points& gradient_before, const Points& h,
                   const Points& h_before, double length, Points& d);

 private:
  struct Pair {
    std::vector<float> s, z;
    std::vector<double> sy, zy;  // <s_i, y>, <z_i, y> with this pair's y, for each older pair i and this one
  };
  std::vector<KeptPair> kept() const;
  std::vector<double> products(const Points& gradient, const Points& gradient_before, const Points& h,
                               const Points& h_before, double length, const Points& d);
  void take_in(const std::vector<double>& sums);

  Workers workers_;
  const std::size_t most_pairs_;
  std::vector<Pair> pairs_;  // oldest first
  Pair candidate_;           // where the next is swept into
  std::vector<double> chunk_sums_;
  double gamma_ = 1;
};

}  // namespace lpdeform
