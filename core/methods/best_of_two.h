#pragma once

#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <optional>

#include "core/methods/minimiser.h"

namespace lpdeform {

/// Runs two methods from the same guess, one after the other. At p near 1 there are many minima, and it is not known in
/// advance in which of them a method ends. The caller's loop keeps the best state of both. The true sum of a step is
/// the lowest so far. The stages of the second method are numbered after those of the first. The outcome is that of the
/// better method.
///
/// As long as the second method is not the better one, it is abandoned after `most_iterations`, or if in 60 iterations
/// its true sum has approached the lowest sum by less than a tenth of the remaining difference. Iterations in which its
/// true sum does not change, as while a coarse level runs, do not count.
class BestOfTwo : public Minimiser {
 public:
  /// `make_second` is called when the first method has ended, unless that method's true sum is at most `zero_sum`,
  /// which leaves nothing to improve. It must leave the evaluation at the guess in problem.objective.
  BestOfTwo(std::unique_ptr<Minimiser> first, std::function<std::unique_ptr<Minimiser>()> make_second,
            int most_iterations, double zero_sum);

  StepResult step() override;
  const Points& x() const override { return present_->x(); }
  std::optional<Points> intermediate_state() override { return present_->intermediate_state(); }
  std::optional<Outcome> outcome_before() const override { return best_outcome_; }
  bool is_best_present() const override { return !is_second_ || is_second_best_; }

 private:
  static constexpr std::size_t kWindow = 60;  // iterations

  StepResult step_first();
  StepResult begin_second();
  bool is_hopeless() const;

  std::unique_ptr<Minimiser> present_;
  std::function<std::unique_ptr<Minimiser>()> make_second_;
  double lowest_ = std::numeric_limits<double>::infinity();  // lowest true sum
  const int most_iterations_;                                // of the second
  const double zero_sum_;
  std::optional<Outcome> best_outcome_;  // empty while the first runs
  bool is_second_ = false, is_second_best_ = false;
  int first_stage_ = 0;  // of the second
  int iterations_ = 0;
  std::deque<double> sums_;  // of the second's last iterations
};

}  // namespace lpdeform
