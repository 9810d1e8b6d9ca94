#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace lpdeform {

/// A share of the process-wide oneTBB thread pool. Work is cut into fixed chunks that depend only on its size, never on
/// the number of threads. A caller that adds up per-chunk results in chunk order therefore gets the same bits on any
/// number of threads. A loop inside a chunk of another loop shares the threads of that one. Thread-safe. It holds no threads
/// while no loop runs, so a process may have thousands.
class Workers {
 public:
  /// At most `threads` >= 1 threads are used, including the calling one; 1 runs everything inline. In a loop inside a chunk of
  /// another one, it is that of the outermost loop that has several threads.
  explicit Workers(int threads);

  int threads() const { return threads_; }

  /// Calls `body(chunk, begin, end)` once for each of the ceil(count / chunk_size) ranges of [0, count). Runs inline if
  /// there is only one chunk. If `body` throws, chunks may be left out, and this throws the same.
  void for_chunks(
      std::size_t count, std::size_t chunk_size,
      const std::function<void(std::size_t chunk, std::size_t begin, std::size_t end)>& body) const;

  /// Calls both functions, at the same time where there are two threads.
  void run_both(const std::function<void()>& first, const std::function<void()>& second) const;

 private:
  struct MoreThanCores;
  int threads_;
  std::shared_ptr<MoreThanCores> more_than_cores_;  // null if there are enough cores
};

/// The number of cores this process may use, at least 1.
int available_cores();

}  // namespace lpdeform
