#include "core/base/workers.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdint>
#include <optional>

#include "core/base/check.h"

#ifdef __SANITIZE_THREAD__
#include <sanitizer/tsan_interface.h>
#endif

namespace lpdeform {
namespace {

#ifdef __SANITIZE_THREAD__
void happens_before(const void* point) {
  __tsan_release(const_cast<void*>(point));
}
void happens_after(const void* point) {
  __tsan_acquire(const_cast<void*>(point));
}
#else
void happens_before(const void*) {}
void happens_after(const void*) {}
#endif

// A loop over chunks in the form that oneTBB calls. oneTBB orders the caller, the chunks and the code after the loop,
// but ThreadSanitizer cannot see this because Debian's library is not built for it. So each step announces the order to
// ThreadSanitizer before it reads any member. In other builds this does nothing.
class ChunkLoop {
 public:
  ChunkLoop(std::size_t chunks, const std::function<void(std::size_t)>& run) : run_(run), chunks_(chunks) {}

  void operator()() const {
    happens_after(&called_);
    tbb::parallel_for(std::size_t{0}, chunks_, *this);
  }
  void operator()(std::size_t chunk) const {
    happens_after(&called_);
    run_(chunk);
    happens_before(&done_);
  }
  void run_in(tbb::task_arena& arena) const {
    happens_before(&called_);
    arena.execute(*this);
    happens_after(&done_);
  }

 private:
  const std::function<void(std::size_t)>& run_;
  const std::size_t chunks_;
  std::uint64_t called_ = 0;  // only their addresses are used
  std::uint64_t done_ = 0;
};

}  // namespace

struct Workers::Arena {
  explicit Arena(int threads) : arena(threads) {
    // Without this, oneTBB never starts more threads than there are cores, however many an arena asks for.
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
  ChunkLoop(chunks, run).run_in(arena_->arena);
}

void Workers::run_both(const std::function<void()>& first, const std::function<void()>& second) const {
  for_chunks(2, 1, [&](std::size_t chunk, std::size_t, std::size_t) { chunk == 0 ? first() : second(); });
}

int available_cores() {
  return std::max(1, tbb::info::default_concurrency());
}

}  // namespace lpdeform
