#include "core/base/workers.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <optional>

#include "core/base/check.h"

namespace lpdeform {

struct Workers::Arena {
  explicit Arena(int threads) : arena(threads) {
    // Without this oneTBB never starts more threads than there are cores, whatever an arena asks for.
    if (threads > available_cores()) {
      control.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
    }
  }

  std::optional<tbb::global_control> control;
  tbb::task_arena arena;
};

Workers::Workers(int threads) : threads_(threads) {
  LPDEFORM_CHECK(threads >= 1);
  if (threads > 1) arena_ = std::make_shared<Arena>(threads);
}

Workers::~Workers() = default;

void Workers::for_chunks(std::size_t count, std::size_t chunk_size,
                         const std::function<void(std::size_t, std::size_t, std::size_t)>& body) const {
  const std::size_t chunks = (count + chunk_size - 1) / chunk_size;
  const auto run = [&](std::size_t chunk) {
    body(chunk, chunk * chunk_size, std::min(count, (chunk + 1) * chunk_size));
  };
  if (!arena_ || chunks <= 1) {
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) run(chunk);
    return;
  }
  arena_->arena.execute([&] { tbb::parallel_for(std::size_t{0}, chunks, run); });
}

int available_cores() { return std::max(1, tbb::info::default_concurrency()); }

}  // namespace lpdeform
