#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

namespace lpdeform {

/// The clock of heartbeats, frame rates and expiry, and a way to be called at a given time. Tests replace it,
/// so that they need not wait for 15 seconds of silence. Thread-safe.
class Timers {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;
  using Action = std::function<void()>;

  virtual ~Timers() = default;

  virtual TimePoint now() const = 0;

  /// Calls `action` once, at or soon after `when`, on the timers' own thread, so it must be short. An action
  /// cannot be cancelled; it should hold its objects weakly.
  virtual void at(TimePoint when, Action action) = 0;
};

/// The machine's steady clock and one thread. The destructor drops actions that are not yet due. It may run
/// in an action.
class SystemTimers final : public Timers {
 public:
  SystemTimers();
  ~SystemTimers() override;

  TimePoint now() const override { return std::chrono::steady_clock::now(); }
  void at(TimePoint when, Action action) override;

 private:
  struct State {
    std::mutex mutex;
    std::condition_variable changed;
    std::multimap<TimePoint, Action> due;
    bool is_stopping = false;
  };
  static void run(const std::shared_ptr<State>& state);

  const std::shared_ptr<State> state_ = std::make_shared<State>();
  std::thread thread_;
};

}  // namespace lpdeform
