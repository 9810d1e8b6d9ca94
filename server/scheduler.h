#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

namespace lpdeform {

/// Work that is done in short slices: a session. The scheduler never runs two slices of one Runnable at a
/// time.
class Runnable {
 public:
  /// `is_heavy`: a slice may take long (factoring a large mesh).
  explicit Runnable(bool is_heavy) : is_heavy_(is_heavy) {}
  virtual ~Runnable() = default;

  /// One slice; must not throw. True where there is more to do; false until the next wake().
  virtual bool run() = 0;

 private:
  friend class Scheduler;
  enum class State { kAsleep, kWaiting, kRunning, kWokenWhileRunning };

  // Guarded by the scheduler's mutex.
  const bool is_heavy_;
  State state_ = State::kAsleep;
  double used_seconds_ = 0;
  std::chrono::steady_clock::time_point ready_since_;
  std::uint64_t ticket_ = 0;
};

/// Shares a pool of threads between sessions: whoever has used the least time goes next. One that slept is
/// put level with the least of those awake, so sleeping earns no credit. There are more threads than cores,
/// and heavy Runnables never take all of them, so that the operating system shares the cores between a long
/// factorisation and everybody else. Thread-safe.
class Scheduler {
 public:
  /// `threads` >= 2. `on_waited` is given the seconds that each slice waited for its thread, on that thread and under
  /// no lock; may be empty.
  explicit Scheduler(int threads, std::function<void(double)> on_waited = {});
  /// Waits for the slices that run; the others are dropped.
  ~Scheduler();

  /// Makes `runnable` run at least once from now on. Does not wait.
  void wake(std::shared_ptr<Runnable> runnable);

  /// Runs `job` once, as a heavy Runnable of its own. Does not wait.
  void run_once(std::function<void()> job);

  int threads() const { return static_cast<int>(threads_.size()); }

  /// max(4, 2 * cores).
  static int default_threads();

 private:
  struct LessUsed {
    bool operator()(const std::shared_ptr<Runnable>& a, const std::shared_ptr<Runnable>& b) const;
  };
  using Queue = std::set<std::shared_ptr<Runnable>, LessUsed>;

  void run();
  void enqueue(std::shared_ptr<Runnable> runnable);
  Queue::iterator next();
  void finish_slice(std::shared_ptr<Runnable> runnable, double seconds, bool has_more);

  const std::function<void(double)> on_waited_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Queue waiting_;
  double level_ = 0;  // the least time used by anyone awake, as last seen
  int heavy_running_ = 0;
  std::uint64_t tickets_ = 0;
  bool is_stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace lpdeform
