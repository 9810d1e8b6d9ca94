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
/// M is the metric. S and Z have columns s = x' - x and z = M^-1 y = h' - h, where y = g' - g. R is the upper triangle
/// of S^T Y, D its diagonal, W = Z^T Y. H_0 = gamma M^-1 with gamma = <s, y> / <z, y> of the newest pair (Nocedal &
/// Wright, 7.20), clamped to [0.05, 4]. gamma corrects two errors of the metric. For p > 2 it lacks the curvature along
/// the residuals, which is (p - 1) times as large, so full steps would be too long. Where rotations follow a step, it
/// overestimates the curvature, so full steps would be about half as long as they should be. clear() keeps gamma.
///
/// Each iteration makes only two passes over all vectors. Pairs and h are in single precision, since they only affect
/// the search direction. Runs in parallel in fixed chunks, which gives the same bits on any number of threads. One
/// caller at a time.
class LbfgsMemory {
 public:
  /// `most_pairs` >= 1.
  LbfgsMemory(Workers workers, std::size_t most_pairs)
      : workers_(std::move(workers)), most_pairs_(most_pairs) {}

  /// Forgets all pairs: M has changed.
  void clear() { pairs_.clear(); }
  /// After clear(), if a step was made since the last direction(): `h` at which it began, with the new M. Swaps h with a buffer.
  void set_before(SinglePoints& h) { candidate_.z.swap(h); }
  bool is_empty() const { return pairs_.empty(); }

  /// d = -H g; returns <g, d>. `length` > 0 means that the step length * d was made since the last call, at which
  /// the gradient was gradient_before and h the h of that call or of set_before(). Its pair is then stored, unless <s, y> is not
  /// positive to rounding. If there are `most_pairs` already, the oldest is dropped, even if the new pair is then not stored. Pass 0
  /// if no step was made, or after clear() without set_before(); then d = -gamma h. Swaps h with a buffer: it is kept for the next call.
  double direction(const Points& gradient, const Points& gradient_before, SinglePoints& h, double length,
                   Points& d);

 private:
  struct Pair {
    SinglePoints s, z;
    std::vector<double> sy, zy;  // <s_i, y>, <z_i, y> with this pair's y, for all older pairs i and this one
  };
  std::vector<KeptPair> kept() const;
  std::vector<double> products(const Points& gradient, const Points& gradient_before, const SinglePoints& h,
                               double length, const Points& d);
  void drop_oldest();
  void take_in(const std::vector<double>& sums);

  Workers workers_;
  const std::size_t most_pairs_;
  std::vector<Pair> pairs_;  // oldest first
  Pair candidate_;           // of the next pair: until it is made, z is the h before
  std::vector<double> chunk_sums_;
  double gamma_ = 1;
};

}  // namespace lpdeform
