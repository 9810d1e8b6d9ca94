#include "server/runtime/timers.h"

#include <utility>

namespace lpdeform {

SystemTimers::SystemTimers() : thread_([state = state_] { run(state); }) {}

SystemTimers::~SystemTimers() {
  std::multimap<TimePoint, Action> dropped;  // destroyed under no lock
  {
    const std::scoped_lock lock(state_->mutex);
    state_->is_stopping = true;
    dropped.swap(state_->due);
  }
  state_->changed.notify_all();
  if (thread_.get_id() == std::this_thread::get_id()) {
    thread_.detach();
  } else {
    thread_.join();
  }
}

void SystemTimers::at(TimePoint when, Action action) {
  const std::scoped_lock lock(state_->mutex);
  state_->due.emplace(when, std::move(action));
  state_->changed.notify_all();
}

void SystemTimers::run(const std::shared_ptr<State>& state) {
  std::unique_lock lock(state->mutex);
  while (!state->is_stopping) {
    if (state->due.empty()) {
      state->changed.wait(lock);
    } else if (const TimePoint first = state->due.begin()->first; first > std::chrono::steady_clock::now()) {
      state->changed.wait_until(lock, first);
    } else {
      Action action = std::move(state->due.extract(state->due.begin()).mapped());
      lock.unlock();
      action();
      action = nullptr;
      lock.lock();
    }
  }
}

}  // namespace lpdeform
