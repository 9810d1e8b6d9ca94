#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>

#include "server/runtime/log.h"

namespace lpdeform {

/// Ends the process if it does not end by itself, for example because a thread waits for a disk: such a
/// thread cannot be stopped. Not thread-safe.
class ProcessEnd {
 public:
  ProcessEnd() = default;
  /// Cancels within(): the process ends by itself.
  ~ProcessEnd();
  ProcessEnd(const ProcessEnd&) = delete;
  ProcessEnd& operator=(const ProcessEnd&) = delete;

  /// Ends the process with `status` after `patience`, unless this object is destroyed before. The log then
  /// says so ("end_forced") and has `for_log` to write its queue. Call it once.
  void within(std::chrono::milliseconds patience, int status, std::weak_ptr<const Log> log,
              std::chrono::milliseconds for_log = kForLog);
  static constexpr std::chrono::milliseconds kForLog{500};

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_ended_ = false;
  std::thread thread_;
};

}  // namespace lpdeform
