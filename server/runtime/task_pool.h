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

/// A few threads that take calls off gRPC's threads: decoding, checks, copies. Tasks run first come, first
/// served, so nothing that factors or solves belongs here; the Scheduler does that. Thread-safe.
class TaskPool {
 public:
  using Task = std::function<void()>;

  /// `threads` >= 1; at most `longest_queue` tasks wait. `on_waited` may be empty. Otherwise it is called
  /// with the seconds that each task waited, on the thread that runs the task.
  TaskPool(int threads, std::size_t longest_queue, std::function<void(double)> on_waited = {});
  /// Finishes the tasks that were accepted.
  ~TaskPool();

  /// Returns false and does nothing if too many tasks wait already.
  [[nodiscard]] bool try_post(Task task);

  /// How long a task that came now would wait, from the length of the queue and the mean time of recent
  /// tasks. At least 50 ms, because the caller that asks was refused.
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
  double mean_seconds_ = 0;  // of the recent tasks
  bool is_stopping_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace lpdeform
