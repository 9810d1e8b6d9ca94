#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include "core/methods/minimiser.h"

namespace lpdeform {

/// Looks for minima lower than a given one by basin hopping (Wales and Doye 1997): minimises from other starts, one after
/// the other, and keeps the lowest state at which a start has ended. A start is first minimised roughly. Only if it then is the
/// lowest, or nearly so, it is minimised to the tolerance, unless it has come back to the lowest state. One caller at a time.
///
/// A start is abandoned after `most_iterations`, or if in 60 iterations its true sum has approached the lowest one by less
/// than 3 % of the remaining difference. Iterations in which its true sum does not change, as while a coarse level runs, do
/// not count.
class MinimaSearch {
 public:
  /// Makes the rough minimiser of a start. It begins at a state that depends only on the number of the start and on `lowest`,
  /// so that a search is the same each time.
  using MakeStart = std::function<std::unique_ptr<Minimiser>(int number, const Points& lowest)>;
  /// Makes the minimiser that goes on from where the rough one has ended.
  using MakeFinish = std::function<std::unique_ptr<Minimiser>(Points x)>;
  struct Scope {
    int first = 0, starts = 0;  // numbers first to first + starts - 1
    int most_iterations = 0;    // of a start
  };

  /// `lowest` is the minimum to begin with, `sum` its true sum.
  MinimaSearch(MakeStart make_start, MakeFinish make_finish, Scope scope, Points lowest, double sum);

  /// Makes one iteration. False when all starts have ended.
  bool step();

  const Points& lowest() const { return lowest_; }
  double lowest_sum() const { return lowest_sum_; }
  /// Whether lowest() is another state than the one to begin with.
  bool has_improved() const { return has_improved_; }
  /// The true sums of the starts that have ended in a minimum, in order. Several may be of the same minimum. One that came back to the
  /// lowest has its sum.
  const std::vector<double>& minima() const { return minima_; }
  /// Starts that have ended, with those that were given up.
  int starts() const { return number_ - scope_.first; }

 private:
  static constexpr std::size_t kWindow = 60;  // iterations

  void begin_start();
  bool is_hopeless() const;
  bool is_lowest_again(const Points& x, double sum) const;
  void end_start(Outcome outcome);

  const MakeStart make_start_;
  const MakeFinish make_finish_;
  const Scope scope_;
  Points lowest_;
  double lowest_sum_;
  bool has_improved_ = false;
  std::vector<double> minima_;

  int number_;                            // of the start that runs, or is next
  std::unique_ptr<Minimiser> minimiser_;  // null between two starts
  bool is_rough_ = true;
  int iterations_ = 0;       // of the start
  std::deque<double> sums_;  // of its last iterations
};

}  // namespace lpdeform
