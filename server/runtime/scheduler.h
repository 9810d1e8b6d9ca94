#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <thread>
#include <vector>

#include "server/runtime/load_gauge.h"

namespace lpdeform {

/// The kinds of slices; the later ones go first.
enum class Urgency {
  kIdle,      // only while no slice of another kind waits
  kOrdinary,  // improves a result that was sent already, or prepares something
  kAnswer,    // a client has sent an update and has not seen any result of it yet
};

/// Work that is done in short slices, such as a session. The scheduler never runs two slices of one Runnable
/// at the same time.
class Runnable {
 public:
  /// `is_heavy`: a slice may take long (factoring a large mesh). `weight` > 0: its share of the time relative
  /// to other Runnables. Work that costs more per step needs a larger share for the same progress.
  explicit Runnable(bool is_heavy, double weight = 1) : is_heavy_(is_heavy), weight_(weight) {}
  virtual ~Runnable() = default;

  /// Runs one slice; must not throw. Returns true if there is more to do, false if there is nothing until the
  /// next wake().
  virtual bool run() = 0;

 protected:
  /// For run(): the next slice is idle, unless wake() is called before.
  void make_next_idle() { is_next_idle_ = true; }

 private:
  friend class Scheduler;
  enum class State { kAsleep, kWaiting, kRunning, kWokenWhileRunning };

  // Guarded by the scheduler's mutex.
  const bool is_heavy_;
  const double weight_;
  State state_ = State::kAsleep;
  Urgency urgency_ = Urgency::kOrdinary;  // of the slice that waits, or of the next one while a slice runs
  bool is_next_idle_ = false;             // written by the running slice
  double used_seconds_ = 0;               // divided by the weight
  std::chrono::steady_clock::time_point ready_since_;
  std::uint64_t ticket_ = 0;
};

/// Shares a pool of threads between sessions. Slices that answer an update go before ordinary ones, but
/// ordinary slices keep a quarter of the time. Within each kind, the Runnable that has used the least time,
/// divided by its weight, goes next. Under overload, therefore, answers are refined later and less often
/// before they come later. A Runnable that slept gets the least used time of those awake, so sleeping earns
/// no credit. Idle slices take at most half of the threads, cost no time, and are no overload. There are more threads than cores, and heavy Runnables never take more than half of them, so
/// that the operating system shares the cores between a long factorisation and all other sessions.
/// Thread-safe.
class Scheduler {
 public:
  /// `threads` >= 2. `on_waited` may be empty. Otherwise it is called with the seconds that each slice waited
  /// for its thread, on that thread and under no lock.
  explicit Scheduler(int threads, std::function<void(double)> on_waited = {});
  /// Waits for the slices that run; drops the others.
  ~Scheduler();

  /// Makes `runnable` run at least once from now on. Does not wait. With Urgency::kAnswer the next slice is
  /// urgent, and those after it are ordinary again. `urgency` is not kIdle: only a running slice asks for that.
  void wake(std::shared_ptr<Runnable> runnable, Urgency urgency = Urgency::kOrdinary);

  /// Runs `job` once, as a heavy Runnable of its own. Does not wait.
  void run_once(std::function<void()> job);

  /// Whether a client waits for an answer. Slices should then be short.
  bool is_answer_waiting() const { return answers_waiting_ > 0; }

  /// Whether slices of either kind wait too long: see LoadGauge.
  bool is_overloaded();

  int threads() const { return static_cast<int>(threads_.size()); }

  /// max(4, 2 * cores).
  static int default_threads();

 private:
  struct LessUsed {
    bool operator()(const std::shared_ptr<Runnable>& a, const std::shared_ptr<Runnable>& b) const;
  };
  using Queue = std::set<std::shared_ptr<Runnable>, LessUsed>;

  using TimePoint = std::chrono::steady_clock::time_point;

  void run();
  void enqueue(std::shared_ptr<Runnable> runnable);
  Queue& queue_of(Urgency urgency);
  LoadGauge& gauge_of(Urgency urgency);
  void hasten(const std::shared_ptr<Runnable>& runnable, Urgency urgency);
  std::shared_ptr<Runnable> take_next();
  bool has_next() const { return may_run(answers_) || may_run(ordinary_) || may_run_idle(); }
  bool may_run(const Queue& queue) const;
  bool may_run_idle() const;
  Queue::const_iterator first(const Queue& queue) const;
  void finish_slice(std::shared_ptr<Runnable> runnable, double seconds, Urgency urgency, bool has_more);

  const std::function<void(double)> on_waited_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Queue answers_, ordinary_, idle_;       // those that wait
  std::atomic<int> answers_waiting_ = 0;  // answers_.size()
  LoadGauge answer_gauge_, ordinary_gauge_;
  double owed_seconds_ = 0;  // what the ordinary slices have not had of their share
  double level_ = 0;         // the least time used by any Runnable awake, as last seen
  int heavy_running_ = 0, idle_running_ = 0;
  std::uint64_t tickets_ = 0;
  bool is_stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace lpdeform
