#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

namespace lpdeform {

/// The clock of heartbeats, frame rates and expiry, and a way to be called at a time of it. Tests put their
/// own in place, so that 15 seconds of silence take none. Thread-safe.
class Timers {
 public:
  using TimePoint = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;
  using Action = std::function<void()>;

  virtual ~Timers() = default;

  virtual TimePoint now() const = 0;

  /// Calls `action` once, at or soon after `when`, on the timers' own thread: it must be short. There is no
  /// way to take it back: actions hold what they are about weakly.
  virtual void at(TimePoint when, Action action) = 0;
};

/// The machine's steady clock and one thread. The destructor drops what is not yet due; it may run in an
/// action.
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
