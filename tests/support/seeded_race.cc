// A program with a data race on purpose. ThreadSanitizer has to report it with tests/support/tsan.supp in
// force: it shows that neither the suppressions nor the thread pool hide races in our own code.

#include <atomic>
#include <cstdio>
#include <string_view>
#include <thread>

#include "core/base/workers.h"

namespace {

volatile int shared_count = 0;

// Returns once both threads are here, or after many tries. Relaxed, so that it orders nothing between the
// two.
void meet(std::atomic<int>& arrived) {
  arrived.fetch_add(1, std::memory_order_relaxed);
  for (int tries = 0; tries < 100000000 && arrived.load(std::memory_order_relaxed) < 2; ++tries) {
  }
}

void count_up() {
  for (int step = 0; step < 1000; ++step) shared_count = shared_count + 1;
}

void race_between_threads() {
  std::atomic<int> arrived = 0;
  const auto count = [&] {
    meet(arrived);
    count_up();
  };
  std::thread first(count);
  std::thread second(count);
  first.join();
  second.join();
}

void race_between_workers() {
  std::atomic<int> arrived = 0;
  lpdeform::Workers(2).for_chunks(2, 1, [&](std::size_t, std::size_t, std::size_t) {
    meet(arrived);
    count_up();
  });
}

}  // namespace

int main(int count, char** arguments) {
  const std::string_view place = count > 1 ? arguments[1] : "";
  if (place == "threads") {
    race_between_threads();
  } else if (place == "workers") {
    race_between_workers();
  } else {
    std::fputs("seeded_race threads|workers\n", stderr);
    return 2;
  }
  std::printf("%d\n", shared_count);
  return 0;
}
