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

/// Who goes first.
enum class Urgency {
  kOrdinary,  // what is there gets better, or is made ready
  kAnswer,    // somebody has sent something and has seen nothing of it yet
};

/// Work that is done in short slices: a session. The scheduler never runs two slices of one Runnable at a
/// time.
class Runnable {
 public:
  /// `is_heavy`: a slice may take long (factoring a large mesh). `weight` > 0: its share beside others; work that
  /// costs more than others' needs more than they to come as far.
  explicit Runnable(bool is_heavy, double weight = 1) : is_heavy_(is_heavy), weight_(weight) {}
  virtual ~Runnable() = default;

  /// One slice; must not throw. True where there is more to do; false until the next wake().
  virtual bool run() = 0;

 private:
  friend class Scheduler;
  enum class State { kAsleep, kWaiting, kRunning, kWokenWhileRunning };

  // Guarded by the scheduler's mutex.
  const bool is_heavy_;
  const double weight_;
  State state_ = State::kAsleep;
  Urgency urgency_ = Urgency::kOrdinary;  // of the slice that waits, or comes after the one that runs
  double used_seconds_ = 0;               // divided by the weight
  std::chrono::steady_clock::time_point ready_since_;
  std::uint64_t ticket_ = 0;
};

/// Shares a pool of threads between sessions. Slices that answer somebody go before ordinary ones, which keep a quarter
/// of the time; within each kind, whoever has used the least time, by its weight, goes next. So where there is too much to
/// do, what suffers first is how soon and how often answers are refined, not how soon they come. One that slept is put
/// level with the least of those awake, so sleeping earns no credit. There are more threads than cores, and heavy
/// Runnables never take more than half of them, so that the operating system shares the cores between a long
/// factorisation and everybody else. Thread-safe.
class Scheduler {
 public:
  /// `threads` >= 2. `on_waited` is given the seconds that each slice waited for its thread, on that thread and under
  /// no lock; may be empty.
  explicit Scheduler(int threads, std::function<void(double)> on_waited = {});
  /// Waits for the slices that run; the others are dropped.
  ~Scheduler();

  /// Makes `runnable` run at least once from now on. Does not wait. Where it is to answer, the next slice is urgent, and
  /// those after it are ordinary again.
  void wake(std::shared_ptr<Runnable> runnable, Urgency urgency = Urgency::kOrdinary);

  /// Runs `job` once, as a heavy Runnable of its own. Does not wait.
  void run_once(std::function<void()> job);

  /// Whether somebody waits for an answer: slices had better be short.
  bool is_answer_waiting() const { return answers_waiting_ > 0; }

  /// Whether slices of either kind wait for too long: see LoadGauge.
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
  void hasten(const std::shared_ptr<Runnable>& runnable);
  std::shared_ptr<Runnable> take_next();
  bool has_next() const { return may_run(answers_) || may_run(ordinary_); }
  bool may_run(const Queue& queue) const;
  Queue::const_iterator first(const Queue& queue) const;
  void finish_slice(std::shared_ptr<Runnable> runnable, double seconds, Urgency urgency, bool has_more);

  const std::function<void(double)> on_waited_;
  std::mutex mutex_;
  std::condition_variable changed_;
  Queue answers_, ordinary_;              // those that wait
  std::atomic<int> answers_waiting_ = 0;  // answers_.size()
  LoadGauge answer_gauge_, ordinary_gauge_;
  double owed_seconds_ = 0;  // to the ordinary ones, of their share
  double level_ = 0;         // the least time used by anyone awake, as last seen
  int heavy_running_ = 0;
  std::uint64_t tickets_ = 0;
  bool is_stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace lpdeform
