#include "server/scheduler.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/base/check.h"
#include "core/base/workers.h"

namespace lpdeform {
namespace {

class OneJob final : public Runnable {
 public:
  explicit OneJob(std::function<void()> job) : Runnable(true), job_(std::move(job)) {}

  bool run() override {
    std::exchange(job_, nullptr)();
    return false;
  }

 private:
  std::function<void()> job_;
};

}  // namespace

bool Scheduler::LessUsed::operator()(const std::shared_ptr<Runnable>& a,
                                     const std::shared_ptr<Runnable>& b) const {
  if (a->used_seconds_ != b->used_seconds_) return a->used_seconds_ < b->used_seconds_;
  return a->ticket_ < b->ticket_;
}

Scheduler::Scheduler(int threads, std::function<void(double)> on_waited) : on_waited_(std::move(on_waited)) {
  LPDEFORM_CHECK(threads >= 2);
  const std::scoped_lock lock(mutex_);  // the first threads ask already how many there are
  for (int k = 0; k < threads; ++k) threads_.emplace_back([this] { run(); });
}

Scheduler::~Scheduler() {
  {
    const std::scoped_lock lock(mutex_);
    is_stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

int Scheduler::default_threads() {
  return std::max(4, 2 * available_cores());
}

void Scheduler::run_once(std::function<void()> job) {
  wake(std::make_shared<OneJob>(std::move(job)));
}

void Scheduler::wake(std::shared_ptr<Runnable> runnable) {
  const std::scoped_lock lock(mutex_);
  if (runnable->state_ == Runnable::State::kRunning) {
    runnable->state_ = Runnable::State::kWokenWhileRunning;
  } else if (runnable->state_ == Runnable::State::kAsleep) {
    runnable->used_seconds_ = std::max(runnable->used_seconds_, level_);
    enqueue(std::move(runnable));
  }
}

void Scheduler::enqueue(std::shared_ptr<Runnable> runnable) {
  runnable->state_ = Runnable::State::kWaiting;
  runnable->ticket_ = ++tickets_;
  runnable->ready_since_ = std::chrono::steady_clock::now();
  waiting_.insert(std::move(runnable));
  changed_.notify_all();
}

/// Who runs next; the end where nobody may.
Scheduler::Queue::iterator Scheduler::next() {
  const bool may_be_heavy = heavy_running_ + 1 < threads();
  return std::find_if(waiting_.begin(), waiting_.end(),
                      [&](const auto& runnable) { return may_be_heavy || !runnable->is_heavy_; });
}

void Scheduler::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return is_stopping_ || next() != waiting_.end(); });
    if (is_stopping_) return;
    std::shared_ptr<Runnable> runnable = std::move(waiting_.extract(next()).value());
    level_ = std::max(level_, runnable->used_seconds_);
    runnable->state_ = Runnable::State::kRunning;
    if (runnable->is_heavy_) ++heavy_running_;

    lock.unlock();
    const auto begin = std::chrono::steady_clock::now();
    if (on_waited_) on_waited_(std::chrono::duration<double>(begin - runnable->ready_since_).count());
    const bool has_more = runnable->run();
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    lock.lock();
    finish_slice(runnable, spent.count(), has_more);

    // The last reference may be ours, and its destructor must not run under the lock.
    lock.unlock();
    runnable.reset();
    lock.lock();
  }
}

void Scheduler::finish_slice(std::shared_ptr<Runnable> runnable, double seconds, bool has_more) {
  if (runnable->is_heavy_) --heavy_running_;
  runnable->used_seconds_ += seconds;
  const bool was_woken = runnable->state_ == Runnable::State::kWokenWhileRunning;
  runnable->state_ = Runnable::State::kAsleep;
  if (has_more || was_woken) {
    enqueue(std::move(runnable));
  } else {
    changed_.notify_all();  // a heavy one may run again
  }
}

}  // namespace lpdeform
