#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace lpdeform {

/// A few threads that take calls off gRPC's: decoding, checks, copies. First come, first served, so nothing
/// that factors or solves belongs here (that is the Scheduler's). Thread-safe.
class TaskPool {
 public:
  using Task = std::function<void()>;

  /// `threads` >= 1; at most `longest_queue` tasks wait. `on_waited` is given the seconds that each waited, on the
  /// thread that runs it; may be empty.
  TaskPool(int threads, std::size_t longest_queue, std::function<void(double)> on_waited = {});
  /// Finishes what was taken on.
  ~TaskPool();

  /// False, and nothing happens, where too many wait already.
  [[nodiscard]] bool try_post(Task task);

  /// How long a task that came now would wait, by those that wait and what tasks took of late; 50 ms at least, because
  /// who asks was refused.
  std::chrono::duration<double> expected_wait() const;

 private:
  struct Waiting {
    Task task;
    std::chrono::steady_clock::time_point since;
  };
  void run();

  const std::size_t longest_queue_;
  const std::function<void(double)> on_waited_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Waiting> tasks_;
  double mean_seconds_ = 0;  // of a task, over the last ones
  bool is_stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace lpdeform
