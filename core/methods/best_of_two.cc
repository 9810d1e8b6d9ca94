#include "core/methods/best_of_two.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace lpdeform {
namespace {

constexpr double kComesNearer = 0.1;  // the least share of the difference to the lowest sum

}  // namespace

BestOfTwo::BestOfTwo(std::unique_ptr<Minimiser> first,
                     std::function<std::unique_ptr<Minimiser>()> make_second, int most_iterations,
                     double zero_sum)
    : present_(std::move(first)),
      make_second_(std::move(make_second)),
      most_iterations_(most_iterations),
      zero_sum_(zero_sum) {}

bool BestOfTwo::is_hopeless() const {
  if (iterations_ >= most_iterations_) return true;
  if (sums_.size() <= kWindow || sums_.back() <= lowest_) return false;
  return sums_.front() - sums_.back() < kComesNearer * (sums_.back() - lowest_);
}

StepResult BestOfTwo::step_first() {
  StepResult result = present_->step();
  lowest_ = std::min(lowest_, result.true_sum.value_or(lowest_));
  first_stage_ = result.stage + 1;
  if (result.outcome == Outcome::kProgress || lowest_ <= zero_sum_) return result;
  best_outcome_ = result.outcome;
  result.outcome = Outcome::kProgress;
  return result;
}

StepResult BestOfTwo::begin_second() {
  is_second_ = true;
  present_.reset();
  present_ = make_second_();
  return {Outcome::kProgress, lowest_, first_stage_ - 1, lowest_};
}

StepResult BestOfTwo::step() {
  if (!best_outcome_) return step_first();
  if (!is_second_) return begin_second();
  StepResult result = present_->step();
  result.stage += first_stage_;
  const double sum = result.true_sum.value_or(std::numeric_limits<double>::infinity());
  if (sums_.empty() || sum != sums_.back()) {  // while a coarse level runs, the sum is that of the guess
    ++iterations_;
    sums_.push_back(sum);
  }
  if (sums_.size() > kWindow + 1) sums_.pop_front();
  if (sums_.back() < lowest_) is_second_best_ = true;
  lowest_ = std::min(lowest_, sums_.back());
  result.true_sum = lowest_;
  const bool is_over = result.outcome != Outcome::kProgress;
  if (!is_second_best_ && (is_over || is_hopeless())) result.outcome = *best_outcome_;
  return result;
}

}  // namespace lpdeform
