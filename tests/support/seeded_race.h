#pragma once

#include <atomic>

/// Deliberate races. ThreadSanitizer must report them with tests/support/tsan.supp in force, which shows that neither the
/// suppressions nor grpc_order.cc hide races in this project's code.

inline volatile int shared_count = 0;

/// Returns once two threads are here, or after many tries. The accesses are relaxed, so that they order nothing between the
/// threads.
inline void meet(std::atomic<int>& arrived) {
  arrived.fetch_add(1, std::memory_order_relaxed);
  for (int tries = 0; tries < 100000000 && arrived.load(std::memory_order_relaxed) < 2; ++tries) {
  }
}

/// Counts many times, because ThreadSanitizer may miss two accesses at exactly the same moment.
inline void count_up() {
  for (int step = 0; step < 1000; ++step) shared_count = shared_count + 1;
}
