#include "core/base/workers.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cstdint>
#include <map>
#include <mutex>
#include <utility>
#include <vector>

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
    const bool was_in_loop = std::exchange(is_in_loop, true);
    run_(chunk);
    is_in_loop = was_in_loop;
    happens_before(&done_);
  }
  void run_in(tbb::task_arena& arena) const {
    happens_before(&called_);
    arena.execute(*this);
    happens_after(&done_);
  }
  /// Inside a chunk of another loop. The thread takes no chunk of that loop while it waits for this one.
  void run_in_present_arena() const {
    happens_before(&called_);
    tbb::this_task_arena::isolate(*this);
    happens_after(&done_);
  }
  static bool is_inside_loop() { return is_in_loop; }

 private:
  static thread_local bool is_in_loop;

  const std::function<void(std::size_t)>& run_;
  const std::size_t chunks_;
  std::uint64_t called_ = 0;  // only their addresses are used
  std::uint64_t done_ = 0;
};

thread_local bool ChunkLoop::is_in_loop = false;

/// Arenas in which no loop runs at present. Each loop borrows one. Whenever an arena asks for threads, oneTBB looks at all others, so
/// with an arena for each session a loop would take the longer the more sessions are open.
class IdleArenas {
 public:
  static IdleArenas& of_process() {
    static auto* const arenas = new IdleArenas;  // never destroyed: loops may run until the process ends
    return *arenas;
  }

  std::unique_ptr<tbb::task_arena> take(int threads) {
    const std::lock_guard lock(mutex_);
    std::vector<std::unique_ptr<tbb::task_arena>>& idle = idle_[threads];
    if (idle.empty()) return std::make_unique<tbb::task_arena>(threads);
    std::unique_ptr<tbb::task_arena> arena = std::move(idle.back());  // its threads may still be awake
    idle.pop_back();
    return arena;
  }
  void put_back(int threads, std::unique_ptr<tbb::task_arena> arena) {
    const std::lock_guard lock(mutex_);
    idle_[threads].push_back(std::move(arena));
  }

 private:
  std::mutex mutex_;
  std::map<int, std::vector<std::unique_ptr<tbb::task_arena>>> idle_;  // by number of threads
};

}  // namespace

/// Without this, oneTBB never starts more threads than there are cores, however many an arena asks for.
struct Workers::MoreThanCores {
  explicit MoreThanCores(int threads)
      : control(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads)) {}
  tbb::global_control control;
};

Workers::Workers(int threads) : threads_(threads) {
  LPDEFORM_CHECK(threads >= 1);
  if (threads > available_cores()) more_than_cores_ = std::make_shared<MoreThanCores>(threads);
}

void Workers::for_chunks(std::size_t count, std::size_t chunk_size,
                         const std::function<void(std::size_t, std::size_t, std::size_t)>& body) const {
  const std::size_t chunks = (count + chunk_size - 1) / chunk_size;
  const auto run = [&](std::size_t chunk) {
    body(chunk, chunk * chunk_size, std::min(count, (chunk + 1) * chunk_size));
  };
  if (threads_ == 1 || chunks <= 1) {
    for (std::size_t chunk = 0; chunk < chunks; ++chunk) run(chunk);
    return;
  }
  const std::function<void(std::size_t)> run_chunk = run;
  const ChunkLoop loop(chunks, run_chunk);
  if (ChunkLoop::is_inside_loop()) return loop.run_in_present_arena();
  std::unique_ptr<tbb::task_arena> arena = IdleArenas::of_process().take(threads_);
  loop.run_in(*arena);
  IdleArenas::of_process().put_back(threads_, std::move(arena));
}

void Workers::run_both(const std::function<void()>& first, const std::function<void()>& second) const {
  for_chunks(2, 1, [&](std::size_t chunk, std::size_t, std::size_t) { chunk == 0 ? first() : second(); });
}

int available_cores() {
  return std::max(1, tbb::info::default_concurrency());
}

}  // namespace lpdeform
