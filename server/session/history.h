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
  std::vector<std::string> regrouped, moved, removed;  // handles that were set are in `moved`, too
  bool begins_step = false;
};

/// The steps of a session's handles that can be undone, followed by the undone steps that can be redone. A
/// step is stored as the changes that lead over it, so a drag takes one motion, however many updates it had.
/// The number of steps and their bytes are bounded; the oldest steps are dropped first. Not thread-safe.
///
/// Updates that move the same handles form one step if each comes within kPause of the one before and does
/// not ask to begin a new step. Any other update that changes handles is a step by itself.
class HandleHistory {
 public:
  explicit HandleHistory(std::size_t most_steps) : most_steps_(most_steps) {}

  /// Records an update that changed `before` to `after` with these effects. Steps that can be redone are dropped. An update that
  /// changed nothing records no step and drops none.
  void note(const HandleSet& before, const HandleSet& after, const HandleEffects& effects,
            Timers::TimePoint now, std::uint64_t revision);

  /// The changes that undo the newest step, or redo the step that was undone last; null if there is none.
  const std::vector<HandleChange>* next(bool redo) const;

  /// The changes of next() were made. `inverse`: the changes in the other direction. `revision`: of the
  /// inputs after the changes.
  void moved(bool redo, std::vector<HandleChange> inverse, std::uint64_t revision);

  std::size_t undo_steps() const { return undo_steps_; }
  std::size_t redo_steps() const { return steps_.size() - undo_steps_; }
  std::size_t bytes() const { return bytes_; }

  /// What is stored: steps from number `first` on, of which `undo_steps` can be undone.
  struct Extent {
    std::uint64_t first = 0;
    std::size_t undo_steps = 0, steps = 0;
  };
  Extent extent() const { return {first_, undo_steps_, steps_.size()}; }

  /// Steps that changed after `revision`, by number, and the numbers of steps that were dropped after it.
  struct Changes {
    std::map<std::uint64_t, std::vector<HandleChange>> steps;
    std::vector<std::uint64_t> dropped;
  };
  Changes changes_since(std::uint64_t revision) const;

  /// Whether the list of dropped steps grew too long and was cleared. Then changes_since() does not know
  /// older drops any more.
  bool forget_dropped();

  /// Continues with the steps that another process had. Steps beyond the limits are dropped.
  void begin_again(std::uint64_t first, std::size_t undo_steps, std::vector<std::vector<HandleChange>> steps);

  static constexpr std::chrono::milliseconds kPause{1000};
  /// A larger step cannot be undone, nor can those before it.
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
  std::size_t undo_steps_ = 0;  // how many steps from the first on can be undone
  std::size_t bytes_ = 0;
  std::map<std::uint64_t, std::uint64_t>
      dropped_;                       // the revision at which a step was dropped, by the step's number
  std::vector<std::string> gesture_;  // the handles that the newest step moves; empty if it is finished
  Timers::TimePoint last_;            // when the newest step was last extended
};

/// The changes that lead back to `before` from the state after `effects`.
std::vector<HandleChange> changes_back(const HandleSet& before, const HandleEffects& effects);

}  // namespace lpdeform
