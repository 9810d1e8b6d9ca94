#pragma once

#include <atomic>
#include <functional>
#include <mutex>
#include <thread>

namespace lpdeform::cli {

/// While it lives, turns the first Ctrl-C (SIGINT) or SIGTERM into a call. A second one ends the program as
/// usual. Only one object at a time.
class Interrupt {
 public:
  Interrupt();
  ~Interrupt();

  /// Sets the action. It runs on another thread, or at once on this one if the signal has come before. It may
  /// wait. The previous action is replaced, after it has ended if it is running. An empty action does nothing.
  void set_action(std::function<void()> action);

  /// Whether the signal has come.
  bool happened() const { return happened_; }

 private:
  void watch();

  std::atomic<bool> happened_ = false;
  std::mutex acting_;  // guards action_, and is held while it runs
  std::function<void()> action_;
  std::thread thread_;
};

}  // namespace lpdeform::cli
