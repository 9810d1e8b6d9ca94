#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>

namespace lpdeform {

/// Gives freed memory back to the system some time after sessions have ended. The allocator keeps it for
/// threads that may never allocate again, so without this a server would hold the memory of its busiest hour
/// forever. Thread-safe.
class HeapTrim {
 public:
  /// `trim` is called on a thread of its own, at most once per `pause`. The default is malloc_trim(0), which
  /// may take tens of milliseconds.
  explicit HeapTrim(std::chrono::milliseconds pause, std::function<void()> trim = release_free_memory);
  /// Does not wait for the pause to end.
  ~HeapTrim();

  /// Something was freed, or will be freed within the pause.
  void after_release();

 private:
  static void release_free_memory();
  void run();

  const std::chrono::milliseconds pause_;
  const std::function<void()> trim_;
  std::mutex mutex_;
  std::condition_variable changed_;
  bool is_asked_ = false, is_stopping_ = false;
  std::thread thread_;
};

}  // namespace lpdeform
