#pragma once

#include <cstddef>
#include <functional>
#include <memory>

namespace lpdeform {

/// A share of the process-wide oneTBB thread pool. Work is cut into fixed chunks that depend on its size
/// alone, never on the number of threads, so that a caller who adds up per-chunk results in chunk order gets
/// the same bits on any number of threads. Thread-safe; copies share the pool.
class Workers {
 public:
  /// `threads` >= 1 are used at most, the calling one included; 1 runs everything inline.
  explicit Workers(int threads);
  ~Workers();

  int threads() const { return threads_; }

  /// Calls `body(chunk, begin, end)` once for each of the ceil(count / chunk_size) ranges of [0, count). Runs
  /// inline when there is one chunk. `body` must not throw.
  void for_chunks(
      std::size_t count, std::size_t chunk_size,
      const std::function<void(std::size_t chunk, std::size_t begin, std::size_t end)>& body) const;

 private:
  struct Arena;
  int threads_;
  std::shared_ptr<Arena> arena_;
};

/// The number of cores this process may use, at least 1.
int available_cores();

}  // namespace lpdeform
