#include "server/task_pool.h"

#include <utility>

namespace lpdeform {

TaskPool::TaskPool(int threads, std::size_t longest_queue) : longest_queue_(longest_queue) {
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
    tasks_.push_back(std::move(task));
  }
  changed_.notify_one();
  return true;
}

void TaskPool::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return is_stopping_ || !tasks_.empty(); });
    if (tasks_.empty()) return;
    Task task = std::move(tasks_.front());
    tasks_.pop_front();
    lock.unlock();
    task();
    task = nullptr;
    lock.lock();
  }
}

}  // namespace lpdeform
