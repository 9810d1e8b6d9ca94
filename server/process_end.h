#pragma once

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>

#include "server/runtime/log.h"

namespace lpdeform {

/// Ends the process where it does not end by itself: nobody can stop a thread that waits for a disk. Not thread-safe.
class ProcessEnd {
 public:
  ProcessEnd() = default;
  /// It ends by itself.
  ~ProcessEnd();
  ProcessEnd(const ProcessEnd&) = delete;
  ProcessEnd& operator=(const ProcessEnd&) = delete;

  /// The process ends after this time, with this status, unless this object goes before. The log then says so ("end_forced"), and has
  /// kForLog to write what waits. To be called once.
  void within(std::chrono::milliseconds patience, int status, std::weak_ptr<const Log> log);
  static constexpr std::chrono::milliseconds kForLog{500};

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_ended_ = false;
  std::thread thread_;
};

}  // namespace lpdeform
