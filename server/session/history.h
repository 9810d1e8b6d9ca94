#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "core/problem/handles.h"
#include "server/runtime/timers.h"
#include "server/session/update.h"

namespace lpdeform {

/// What an update did to handles, by their names.
struct HandleEffects {
  std::vector<std::string> regrouped, moved, removed;  // those set are also moved
  bool begins_step = false;
};

/// The steps of a session's handles that can be taken back, and after them those that were, which can be done again. A step
/// is kept as the changes that lead over it: so a drag keeps one motion, however many updates it had. Bounded by the number
/// of steps and by bytes; the oldest go first. Not thread-safe.
///
/// Updates that move the same handles, none of them over kPause after the one before, are one step, unless they say
/// that they begin one; each other update that changes handles is one by itself.
class HandleHistory {
 public:
  explicit HandleHistory(std::size_t most_steps) : most_steps_(most_steps) {}

  /// An update was taken that made `after` of `before`. What was taken back is forgotten, unless the update changed nothing: then
  /// it is no step either.
  void note(const HandleSet& before, const HandleSet& after, const HandleEffects& effects,
            Timers::TimePoint now, std::uint64_t revision);

  /// The changes that take the newest step back, or do the last one that was taken back again; null where there is none.
  const std::vector<HandleChange>* next(bool redo) const;

  /// They were made: `inverse` leads the other way. `revision`: of the inputs since then.
  void moved(bool redo, std::vector<HandleChange> inverse, std::uint64_t revision);

  std::size_t undo_steps() const { return undo_steps_; }
  std::size_t redo_steps() const { return steps_.size() - undo_steps_; }
  std::size_t bytes() const { return bytes_; }

  /// As it is kept: steps `first` and on, of which so many can be taken back.
  struct Extent {
    std::uint64_t first = 0;
    std::size_t undo_steps = 0, steps = 0;
  };
  Extent extent() const { return {first_, undo_steps_, steps_.size()}; }

  /// Steps that are another since `revision`, by number, and those that are no more.
  struct Changes {
    std::map<std::uint64_t, std::vector<HandleChange>> steps;
    std::vector<std::uint64_t> dropped;
  };
  Changes changes_since(std::uint64_t revision) const;

  /// Whether changes_since() knows no more of steps that went longer ago; from then on it does again.
  bool forget_dropped();

  /// What another process had. What is over the limits goes.
  void begin_again(std::uint64_t first, std::size_t undo_steps, std::vector<std::vector<HandleChange>> steps);

  static constexpr std::chrono::milliseconds kPause{1000};
  /// A step that is larger cannot be taken back, nor can those before it.
  static constexpr std::size_t kMostBytesAStep = 1u << 20;
  static constexpr std::size_t kMostBytes = 8u << 20;

 private:
  struct Step {
    std::vector<HandleChange> changes;
    std::size_t bytes = 0;
    std::uint64_t revision = 0;
  };
  void put(std::size_t place, std::vector<HandleChange> changes, std::uint64_t revision);
  void drop_last(std::uint64_t revision);
  void drop_first(std::uint64_t revision);
  void keep_limits(std::uint64_t revision);

  const std::size_t most_steps_;
  std::deque<Step> steps_;
  std::uint64_t first_ = 0;     // the number of steps_[0]
  std::size_t undo_steps_ = 0;  // the first so many of them
  std::size_t bytes_ = 0;
  std::map<std::uint64_t, std::uint64_t> dropped_;  // since which revision, by number
  std::vector<std::string> gesture_;                // what the newest step moves; empty where it is over
  Timers::TimePoint last_;                          // when it was moved
};

/// The changes that lead from where `effects` led to back to `before`.
std::vector<HandleChange> changes_back(const HandleSet& before, const HandleEffects& effects);

}  // namespace lpdeform
