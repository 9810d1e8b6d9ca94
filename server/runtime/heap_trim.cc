#include "server/runtime/heap_trim.h"

#include <malloc.h>

#include <utility>

namespace lpdeform {

HeapTrim::HeapTrim(std::chrono::milliseconds pause, std::function<void()> trim)
    : pause_(pause), trim_(std::move(trim)), thread_([this] { run(); }) {}

HeapTrim::~HeapTrim() {
  {
    const std::scoped_lock lock(mutex_);
    is_stopping_ = true;
  }
  changed_.notify_one();
  thread_.join();
}

void HeapTrim::after_release() {
  {
    const std::scoped_lock lock(mutex_);
    if (std::exchange(is_asked_, true)) return;
  }
  changed_.notify_one();
}

void HeapTrim::release_free_memory() {
  malloc_trim(0);
}

void HeapTrim::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return is_asked_ || is_stopping_; });
    changed_.wait_for(lock, pause_, [this] { return is_stopping_; });
    if (is_stopping_) return;
    is_asked_ = false;
    lock.unlock();
    trim_();
    lock.lock();
  }
}

}  // namespace lpdeform
