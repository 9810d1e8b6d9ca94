#include "core/methods/minima_search.h"

#include <limits>
#include <utility>

namespace lpdeform {
namespace {

constexpr double kComesNearer = 0.03;     // the least share of the difference to the lowest sum
constexpr double kWorthFinishing = 1.02;  // a rough minimum's sum over the lowest, at most
// A rough minimum is the lowest one again if its sum is above the lowest by at most this share, and no vertex is farther from its place
// there than a mean edge length, the scaled unit.
constexpr double kSameSum = 1e-4, kNear = 1;

}  // namespace

MinimaSearch::MinimaSearch(MakeStart make_start, MakeFinish make_finish, Scope scope, Points lowest,
                           double sum)
    : make_start_(std::move(make_start)),
      make_finish_(std::move(make_finish)),
      scope_(scope),
      lowest_(std::move(lowest)),
      lowest_sum_(sum),
      number_(scope.first) {}

void MinimaSearch::begin_start() {
  minimiser_ = make_start_(number_, lowest_);
  is_rough_ = true;
  iterations_ = 0;
  sums_.clear();
}

bool MinimaSearch::is_hopeless() const {
  if (iterations_ >= scope_.most_iterations) return true;
  if (sums_.size() <= kWindow || sums_.back() <= lowest_sum_) return false;
  return sums_.front() - sums_.back() < kComesNearer * (sums_.back() - lowest_sum_);
}

/// Whether the rough minimum x with this true sum is the lowest one again.
bool MinimaSearch::is_lowest_again(const Points& x, double sum) const {
  if (!(sum >= lowest_sum_ && sum - lowest_sum_ <= kSameSum * lowest_sum_)) return false;
  return (x - lowest_).rowwise().squaredNorm().maxCoeff() <= kNear * kNear;
}

void MinimaSearch::end_start(Outcome outcome) {
  const double sum = sums_.back();
  const bool is_minimum = outcome == Outcome::kConverged || outcome == Outcome::kStalled;
  if (is_minimum && is_rough_ && is_lowest_again(minimiser_->x(), sum)) {
    minima_.push_back(lowest_sum_);
    minimiser_.reset();
    ++number_;
    return;
  }
  if (is_minimum && is_rough_ && sum < kWorthFinishing * lowest_sum_) {
    Points rough = minimiser_->x();
    minimiser_.reset();  // two of them would take twice the memory
    minimiser_ = make_finish_(std::move(rough));
    is_rough_ = false;
    sums_.clear();
    return;
  }
  if (is_minimum && !is_rough_) minima_.push_back(sum);
  if (is_minimum && sum < lowest_sum_) {
    lowest_ = minimiser_->x();
    lowest_sum_ = sum;
    has_improved_ = true;
  }
  minimiser_.reset();
  ++number_;
}

bool MinimaSearch::step() {
  if (number_ >= scope_.first + scope_.starts) return false;
  if (!minimiser_) {
    begin_start();
    return true;
  }
  const StepResult result = minimiser_->step();
  const double sum = result.true_sum.value_or(std::numeric_limits<double>::infinity());
  if (sums_.empty() || sum != sums_.back()) {
    ++iterations_;
    sums_.push_back(sum);
  }
  if (sums_.size() > kWindow + 1) sums_.pop_front();
  if (result.outcome != Outcome::kProgress || is_hopeless()) end_start(result.outcome);
  return number_ < scope_.first + scope_.starts;
}

}  // namespace lpdeform
