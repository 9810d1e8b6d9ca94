#pragma once

#include <map>
#include <mutex>
#include <utility>

#include "server/timers.h"

namespace lpdeform {

/// A clock that stands still until a test moves it.
class ManualTimers final : public Timers {
 public:
  TimePoint now() const override {
    const std::scoped_lock lock(mutex_);
    return now_;
  }

  void at(TimePoint when, Action action) override {
    const std::scoped_lock lock(mutex_);
    due_.emplace(when, std::move(action));
  }

  /// Runs what becomes due, in order, on this thread.
  void advance(Duration by) {
    const TimePoint target = now() + by;
    for (;;) {
      Action action;
      {
        const std::scoped_lock lock(mutex_);
        if (due_.empty() || due_.begin()->first > target) {
          now_ = target;
          return;
        }
        now_ = std::max(now_, due_.begin()->first);
        action = std::move(due_.extract(due_.begin()).mapped());
      }
      action();
    }
  }

  std::size_t waiting() const {
    const std::scoped_lock lock(mutex_);
    return due_.size();
  }

 private:
  mutable std::mutex mutex_;
  TimePoint now_{std::chrono::hours(1)};
  std::multimap<TimePoint, Action> due_;
};

}  // namespace lpdeform
