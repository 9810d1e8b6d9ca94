#include "server/runtime/scheduler.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/base/check.h"
#include "core/base/workers.h"

namespace lpdeform {
namespace {

/// While ordinary slices wait, they are owed this many seconds for each second of answers: a quarter of all
/// time.
constexpr double kOwed = 1.0 / 3;
constexpr double kMostOwed = 0.1;

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
  const std::scoped_lock lock(mutex_);  // the first threads ask for the number of threads at once
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

void Scheduler::wake(std::shared_ptr<Runnable> runnable, Urgency urgency) {
  const std::scoped_lock lock(mutex_);
  switch (runnable->state_) {
    case Runnable::State::kAsleep:
      runnable->urgency_ = urgency;
      runnable->used_seconds_ = std::max(runnable->used_seconds_, level_);
      enqueue(std::move(runnable));
      return changed_.notify_one();
    case Runnable::State::kWaiting:
      if (urgency > runnable->urgency_) hasten(runnable, urgency);
      return;
    default:
      runnable->state_ = Runnable::State::kWokenWhileRunning;
      runnable->urgency_ = std::max(runnable->urgency_, urgency);
  }
}

Scheduler::Queue& Scheduler::queue_of(Urgency urgency) {
  if (urgency == Urgency::kIdle) return idle_;
  return urgency == Urgency::kAnswer ? answers_ : ordinary_;
}

LoadGauge& Scheduler::gauge_of(Urgency urgency) {
  return urgency == Urgency::kAnswer ? answer_gauge_ : ordinary_gauge_;
}

void Scheduler::enqueue(std::shared_ptr<Runnable> runnable) {
  runnable->state_ = Runnable::State::kWaiting;
  runnable->ticket_ = ++tickets_;
  runnable->ready_since_ = std::chrono::steady_clock::now();
  queue_of(runnable->urgency_).insert(std::move(runnable));
  answers_waiting_ = static_cast<int>(answers_.size());
}

/// A Runnable that waits has become more urgent. The time that it has waited in the ordinary queue counts as a wait.
void Scheduler::hasten(const std::shared_ptr<Runnable>& runnable, Urgency urgency) {
  const TimePoint now = std::chrono::steady_clock::now();
  if (runnable->urgency_ == Urgency::kOrdinary) ordinary_gauge_.waited(now - runnable->ready_since_, now);
  queue_of(runnable->urgency_).erase(runnable);
  runnable->urgency_ = urgency;
  enqueue(runnable);
  changed_.notify_one();
}

/// The Runnable in `queue` that may run now and has used the least time; end() if none may run.
Scheduler::Queue::const_iterator Scheduler::first(const Queue& queue) const {
  const bool may_be_heavy = heavy_running_ < std::max(1, threads() / 2);
  return std::find_if(queue.begin(), queue.end(),
                      [&](const auto& runnable) { return may_be_heavy || !runnable->is_heavy_; });
}

bool Scheduler::may_run(const Queue& queue) const {
  return first(queue) != queue.end();
}

bool Scheduler::may_run_idle() const {
  const bool is_nobody_waiting = answers_.empty() && ordinary_.empty();
  return is_nobody_waiting && idle_running_ < std::max(1, threads() / 2) && may_run(idle_);
}

std::shared_ptr<Runnable> Scheduler::take_next() {
  const bool is_ordinarys_turn = may_run(ordinary_) && (owed_seconds_ > 0 || !may_run(answers_));
  const bool is_idle = !may_run(ordinary_) && !may_run(answers_);
  Queue& queue = is_idle ? idle_ : is_ordinarys_turn ? ordinary_ : answers_;
  std::shared_ptr<Runnable> runnable = std::move(queue.extract(first(queue)).value());
  answers_waiting_ = static_cast<int>(answers_.size());
  if (is_idle)
    ++idle_running_;
  else
    level_ = std::max(level_, runnable->used_seconds_);
  runnable->state_ = Runnable::State::kRunning;
  if (runnable->is_heavy_) ++heavy_running_;
  return runnable;
}

void Scheduler::run() {
  std::unique_lock lock(mutex_);
  for (;;) {
    changed_.wait(lock, [this] { return is_stopping_ || has_next(); });
    if (is_stopping_) return;
    std::shared_ptr<Runnable> runnable = take_next();
    const Urgency urgency = std::exchange(runnable->urgency_, Urgency::kOrdinary);
    runnable->is_next_idle_ = false;
    const TimePoint begin = std::chrono::steady_clock::now();
    const auto wait = begin - runnable->ready_since_;
    const bool is_idle = urgency == Urgency::kIdle;
    if (!is_idle) gauge_of(urgency).waited(wait, begin);

    lock.unlock();
    if (on_waited_ && !is_idle) on_waited_(std::chrono::duration<double>(wait).count());
    const bool has_more = runnable->run();
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    lock.lock();
    finish_slice(runnable, spent.count(), urgency, has_more);

    // The last reference may be this one, and the destructor must not run under the lock.
    lock.unlock();
    runnable.reset();
    lock.lock();
  }
}

void Scheduler::finish_slice(std::shared_ptr<Runnable> runnable, double seconds, Urgency urgency,
                             bool has_more) {
  if (runnable->is_heavy_) --heavy_running_;
  if (urgency == Urgency::kIdle) {
    --idle_running_;
  } else {
    runnable->used_seconds_ += seconds / runnable->weight_;
    owed_seconds_ += urgency == Urgency::kAnswer ? kOwed * seconds : -seconds;
    owed_seconds_ = std::clamp(owed_seconds_, -kMostOwed, ordinary_.empty() ? 0 : kMostOwed);
  }
  const bool was_woken = runnable->state_ == Runnable::State::kWokenWhileRunning;
  runnable->state_ = Runnable::State::kAsleep;
  if (has_more && !was_woken && runnable->is_next_idle_) runnable->urgency_ = Urgency::kIdle;
  // No other thread needs to be woken: this thread is free now, for this Runnable or for a heavy one that had
  // to wait.
  if (has_more || was_woken) enqueue(std::move(runnable));
}

bool Scheduler::is_overloaded() {
  const std::scoped_lock lock(mutex_);
  const TimePoint now = std::chrono::steady_clock::now();
  const bool is_answering_late = answer_gauge_.is_overloaded(now);
  return ordinary_gauge_.is_overloaded(now) || is_answering_late;
}

}  // namespace lpdeform
