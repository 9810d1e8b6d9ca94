#include "server/runtime/task_pool.h"

#include <algorithm>
#include <utility>

namespace lpdeform {
namespace {

constexpr double kMeanTasks = 64;  // about this many tasks make the mean time

}  // namespace

TaskPool::TaskPool(int threads, std::size_t longest_queue, std::function<void(double)> on_waited)
    : longest_queue_(longest_queue), on_waited_(std::move(on_waited)) {
  for (int k = 0; k < threads; ++k) threads_.emplace_back([this] { run(); });
}

TaskPool::~TaskPool() {
  {
    const std::scoped_lock lock(mutex_);
    is_stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

bool TaskPool::try_post(Task task) {
  {
    const std::scoped_lock lock(mutex_);
    if (tasks_.size() >= longest_queue_) return false;
    tasks_.push_back({std::move(task), std::chrono::steady_clock::now()});
  }
  changed_.notify_one();
  return true;
}

std::chrono::duration<double> TaskPool::expected_wait() const {
  const std::scoped_lock lock(mutex_);
  const double wait =
      mean_seconds_ * static_cast<double>(tasks_.size()) / static_cast<double>(threads_.size());
  return std::chrono::duration<double>(std::max(0.05, wait));
}

void TaskPool::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return is_stopping_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    Waiting waiting = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    if (on_waited_) {
      on_waited_(std::chrono::duration<double>(std::chrono::steady_clock::now() - waiting.since).count());
    }
    const auto begin = std::chrono::steady_clock::now();
    waiting.task();
    waiting.task = nullptr;
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    lock.lock();
    mean_seconds_ += (spent.count() - mean_seconds_) / kMeanTasks;
  }
}

}  // namespace lpdeform
