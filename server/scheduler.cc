#include "server/scheduler.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/base/check.h"
#include "core/base/workers.h"

namespace lpdeform {
namespace {

/// Of each second of answers, while ordinary slices wait, these get so much: a quarter of all.
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
  const std::scoped_lock lock(mutex_);  // the first threads ask already how many there are
  for (int k = 0; k < threads; ++k) {
    threads_.emplace_back([this, &lane = k < threads / 2 ? heavy_ : light_] { run(lane); });
  }
}

Scheduler::~Scheduler() {
  {
    const std::scoped_lock lock(mutex_);
    is_stopping_ = true;
  }
  light_.changed.notify_all();
  heavy_.changed.notify_all();
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
  const bool is_answer = urgency == Urgency::kAnswer;
  Lane& lane = lane_of(*runnable);
  switch (runnable->state_) {
    case Runnable::State::kAsleep:
      runnable->urgency_ = urgency;
      runnable->used_seconds_ = std::max(runnable->used_seconds_, lane.level);
      enqueue(std::move(runnable));
      return lane.changed.notify_one();
    case Runnable::State::kWaiting:
      if (is_answer && runnable->urgency_ != Urgency::kAnswer) hasten(runnable);
      return;
    default:
      runnable->state_ = Runnable::State::kWokenWhileRunning;
      if (is_answer) runnable->urgency_ = Urgency::kAnswer;
  }
}

LoadGauge& Scheduler::gauge_of(Urgency urgency) {
  return urgency == Urgency::kAnswer ? answer_gauge_ : ordinary_gauge_;
}

void Scheduler::enqueue(std::shared_ptr<Runnable> runnable) {
  runnable->state_ = Runnable::State::kWaiting;
  runnable->ticket_ = ++tickets_;
  runnable->ready_since_ = std::chrono::steady_clock::now();
  lane_of(*runnable).queue_of(runnable->urgency_).insert(runnable);
  count_answers();
}

void Scheduler::count_answers() {
  answers_waiting_ = static_cast<int>(light_.answers.size() + heavy_.answers.size());
}

/// One that waits in the ordinary queue is to answer now. That it was put off until then counts.
void Scheduler::hasten(const std::shared_ptr<Runnable>& runnable) {
  const TimePoint now = std::chrono::steady_clock::now();
  ordinary_gauge_.waited(now - runnable->ready_since_, now);
  lane_of(*runnable).ordinary.erase(runnable);
  runnable->urgency_ = Urgency::kAnswer;
  enqueue(runnable);
}

/// Who used the least; the lane is not empty.
std::shared_ptr<Runnable> Scheduler::take_next(Lane& lane) {
  const bool is_ordinarys_turn = !lane.ordinary.empty() && (lane.owed_seconds > 0 || lane.answers.empty());
  Queue& queue = is_ordinarys_turn ? lane.ordinary : lane.answers;
  std::shared_ptr<Runnable> runnable = std::move(queue.extract(queue.begin()).value());
  count_answers();
  lane.level = std::max(lane.level, runnable->used_seconds_);
  runnable->state_ = Runnable::State::kRunning;
  return runnable;
}

void Scheduler::run(Lane& lane) {
  std::unique_lock lock(mutex_);
  for (;;) {
    lane.changed.wait(lock, [&] { return is_stopping_ || !lane.is_empty(); });
    if (is_stopping_) return;
    std::shared_ptr<Runnable> runnable = take_next(lane);
    const Urgency urgency = std::exchange(runnable->urgency_, Urgency::kOrdinary);
    const TimePoint begin = std::chrono::steady_clock::now();
    const auto wait = begin - runnable->ready_since_;
    gauge_of(urgency).waited(wait, begin);

    lock.unlock();
    if (on_waited_) on_waited_(std::chrono::duration<double>(wait).count());
    const bool has_more = runnable->run();
    const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - begin;
    lock.lock();
    finish_slice(runnable, spent.count(), urgency, has_more);

    // The last reference may be ours, and its destructor must not run under the lock.
    lock.unlock();
    runnable.reset();
    lock.lock();
  }
}

void Scheduler::finish_slice(std::shared_ptr<Runnable> runnable, double seconds, Urgency urgency,
                             bool has_more) {
  Lane& lane = lane_of(*runnable);
  runnable->used_seconds_ += seconds / runnable->weight_;
  lane.owed_seconds += urgency == Urgency::kAnswer ? kOwed * seconds : -seconds;
  lane.owed_seconds = std::clamp(lane.owed_seconds, -kMostOwed, lane.ordinary.empty() ? 0 : kMostOwed);
  const bool was_woken = runnable->state_ == Runnable::State::kWokenWhileRunning;
  runnable->state_ = Runnable::State::kAsleep;
  // Nobody has to be woken: this thread is free now.
  if (has_more || was_woken) enqueue(std::move(runnable));
}

bool Scheduler::is_overloaded() {
  const std::scoped_lock lock(mutex_);
  const TimePoint now = std::chrono::steady_clock::now();
  const bool is_answering_late = answer_gauge_.is_overloaded(now);
  return ordinary_gauge_.is_overloaded(now) || is_answering_late;
}

}  // namespace lpdeform
