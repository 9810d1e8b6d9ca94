#include "server/calls/call_gate.h"

namespace lpdeform {

CallGate::Permit CallGate::enter() {
  const std::scoped_lock lock(mutex_);
  if (is_closed_) return nullptr;
  ++calls_;
  return {this, [](CallGate* gate) {
            const std::scoped_lock leaving(gate->mutex_);
            if (--gate->calls_ == 0) gate->changed_.notify_all();
          }};
}

void CallGate::close() {
  const std::scoped_lock lock(mutex_);
  is_closed_ = true;
}

bool CallGate::is_closed() const {
  const std::scoped_lock lock(mutex_);
  return is_closed_;
}

bool CallGate::wait_until_empty(std::chrono::steady_clock::time_point deadline) {
  std::unique_lock lock(mutex_);
  return changed_.wait_until(lock, deadline, [this] { return calls_ == 0; });
}

}  // namespace lpdeform
