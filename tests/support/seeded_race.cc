// seeded_race threads|workers: a race between two threads, or between two threads of the pool. See
// seeded_race.h.

#include "tests/support/seeded_race.h"

#include <cstdio>
#include <string_view>
#include <thread>

#include "core/base/workers.h"

namespace {

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
