#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <thread>

namespace lpdeform::cli {

/// Turns the first Ctrl-C (SIGINT) or SIGTERM into a call, for as long as it lives; a second one ends the
/// program as ever. One at a time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();

  /// What to do, on another thread, or at once on this one where the signal has come before. It may wait.
  /// Replaces the action before, after that has ended where it runs; empty does nothing.
  void set_action(std::function<void()> action);

  /// The signal has come.
  bool happened() const { return happened_; }

 private:
  void watch();

  std::atomic<bool> happened_ = false;
  std::mutex acting_;  // guards action_, and is held while it runs
  std::function<void()> action_;
  std::thread thread_;
};

}  // namespace lpdeform::cli
