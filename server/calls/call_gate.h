#pragma once

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>

namespace lpdeform {

/// Counts the calls under way, so that a draining server can refuse new calls and wait for the others.
/// Thread-safe.
class CallGate {
 public:
  /// Held for as long as a call lasts.
  using Permit = std::shared_ptr<void>;

  /// Null once the gate is closed. Permits must not outlive the gate.
  Permit enter();

  void close();
  bool is_closed() const;

  /// Waits until no permit is held; false if `deadline` comes first.
  bool wait_until_empty(std::chrono::steady_clock::time_point deadline);

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  bool is_closed_ = false;
  std::size_t calls_ = 0;
};

}  // namespace lpdeform
