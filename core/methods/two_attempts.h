#pragma once

#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <optional>

#include "core/methods/minimiser.h"

namespace lpdeform {

/// Two methods from the same guess, one after the other: at p near 1 there are many minima, and which of them a method ends in
/// is not known before. The caller's loop keeps the best state of both; the true sums of steps are the lowest so far, and the
/// stages of the second follow those of the first. Outcome: that of the better one.
///
/// Unless it is the better one, the second is given up after `most_iterations`, and where in 60 iterations its true sum has come nearer to the lowest by
/// less than a tenth of what is left. Iterations of a coarse level, in which it does not change, do not count.
class TwoAttempts : public Minimiser {
 public:
  /// `make_second` is called once the first has ended, unless its true sum is at most `zero_sum`: then there is nothing to
  /// gain. It leaves the evaluation at the guess in problem.objective.
  TwoAttempts(std::unique_ptr<Minimiser> first, std::function<std::unique_ptr<Minimiser>()> make_second,
              int most_iterations, double zero_sum);

  StepResult step() override;
  const Points& x() const override { return present_->x(); }
  std::optional<Points> in_hand() override { return present_->in_hand(); }
  std::optional<Outcome> outcome_before() const override { return best_outcome_; }
  bool is_best_present() const override { return !is_second_ || is_second_best_; }

 private:
  static constexpr std::size_t kWindow = 60;  // iterations

  StepResult step_first();
  StepResult begin_second();
  bool is_hopeless() const;

  std::unique_ptr<Minimiser> present_;
  std::function<std::unique_ptr<Minimiser>()> make_second_;
  double lowest_ = std::numeric_limits<double>::infinity();  // true sum
  const int most_iterations_;                                // of the second
  const double zero_sum_;
  std::optional<Outcome> best_outcome_;  // none while the first runs
  bool is_second_ = false, is_second_best_ = false;
  int first_stage_ = 0;  // of the second
  int iterations_ = 0;
  std::deque<double> sums_;  // of the second's last iterations
};

}  // namespace lpdeform
