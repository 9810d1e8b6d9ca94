#include "core/base/workers.h"

#include <tbb/global_control.h>
#include <tbb/info.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <tbb/task_group.h>

#include <algorithm>
#include <cstdint>
#include <iterator>
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

/// Whether this thread runs a chunk.
thread_local bool is_in_chunk = false;

class InChunk {
 public:
  InChunk() : was_in_chunk_(std::exchange(is_in_chunk, true)) {}
  ~InChunk() { is_in_chunk = was_in_chunk_; }
  InChunk(const InChunk&) = delete;
  InChunk& operator=(const InChunk&) = delete;

 private:
  const bool was_in_chunk_;
};

// A loop over chunks in the form that oneTBB calls. oneTBB orders the caller, the chunks and the code after the loop,
// but ThreadSanitizer cannot see this because Debian's library is not built for it. So each step announces the order to
// ThreadSanitizer before it reads any member. In other builds this does nothing.
class ChunkLoop {
 public:
  ChunkLoop(std::size_t chunks, const std::function<void(std::size_t)>& run) : run_(run), chunks_(chunks) {}

  void operator()() const {
    happens_after(&called_);
    tbb::parallel_for(std::size_t{0}, chunks_, *this, context_);
  }
  void operator()(std::size_t chunk) const {
    happens_after(&called_);
    const Release release{&done_};
    const InChunk guard;
    run_(chunk);
  }
  void run_in(tbb::task_arena& arena) const {
    happens_before(&called_);
    const Acquire acquire{&done_};
    arena.execute(*this);
  }
  /// Inside a chunk of another loop. The thread takes no chunk of that loop while it waits for this one.
  void run_in_present_arena() const {
    happens_before(&called_);
    const Acquire acquire{&done_};
    tbb::this_task_arena::isolate(*this);
  }

 private:
  /// Announce the order at their end, also where a chunk has thrown.
  struct Release {
    ~Release() { happens_before(point); }
    const void* point;
  };
  struct Acquire {
    ~Acquire() { happens_after(point); }
    const void* point;
  };

  const std::function<void(std::size_t)>& run_;
  const std::size_t chunks_;
  /// Takes the caller's floating-point settings along. An arena keeps those of the thread that first used it.
  mutable tbb::task_group_context context_{
      tbb::task_group_context::isolated,
      tbb::task_group_context::default_traits | tbb::task_group_context::fp_settings};
  std::uint64_t called_ = 0;  // only their addresses are used
  std::uint64_t done_ = 0;
};

/// Arenas in which no loop runs at present. Each loop borrows one. Whenever an arena asks for threads, oneTBB looks at all others, so
/// loops would take the longer the more sessions are open if each session had its own.
class IdleArenas {
 public:
  static IdleArenas& of_process() {
    static auto* const arenas = new IdleArenas;  // never destroyed: loops may run until the process ends
    return *arenas;
  }

  /// An arena that was used not long ago, because its threads may still be awake.
  std::unique_ptr<tbb::task_arena> take(int threads) {
    if (const std::unique_lock lock(mutex_, std::try_to_lock); lock.owns_lock()) {
      const auto same = std::find_if(idle_.rbegin(), idle_.rend(),
                                     [&](const auto& arena) { return arena->max_concurrency() == threads; });
      if (same != idle_.rend()) {
        std::unique_ptr<tbb::task_arena> arena = std::move(*same);
        idle_.erase(std::next(same).base());
        return arena;
      }
    }
    return std::make_unique<tbb::task_arena>(threads);
  }

  void put_back(std::unique_ptr<tbb::task_arena> arena) {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock.owns_lock()) return;
    if (idle_.size() == most_) idle_.erase(idle_.begin());
    idle_.push_back(std::move(arena));
  }

 private:
  IdleArenas() { idle_.reserve(most_); }

  const std::size_t most_ = static_cast<std::size_t>(available_cores());
  std::mutex mutex_;  // is never waited for: after a fork nobody might release it
  std::vector<std::unique_ptr<tbb::task_arena>> idle_;
};

}  // namespace

/// Without this, oneTBB never starts more threads than there are cores, however many an arena asks for. It obeys the lowest of all
/// limits, so this one is the same for all: the most that oneTBB ever has.
struct Workers::MoreThanCores {
  tbb::global_control control{tbb::global_control::max_allowed_parallelism,
                              static_cast<std::size_t>(std::max(256, 4 * available_cores()))};
};

Workers::Workers(int threads) : threads_(threads) {
  LPDEFORM_CHECK(threads >= 1);
  if (threads > available_cores()) more_than_cores_ = std::make_shared<MoreThanCores>();
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
  const std::function<void(std::size_t)> run_chunk = std::ref(run);  // which allocates nothing
  const ChunkLoop loop(chunks, run_chunk);
  if (is_in_chunk) return loop.run_in_present_arena();
  std::unique_ptr<tbb::task_arena> arena = IdleArenas::of_process().take(threads_);
  loop.run_in(*arena);
  IdleArenas::of_process().put_back(std::move(arena));
}

void Workers::run_both(const std::function<void()>& first, const std::function<void()>& second) const {
  for_chunks(2, 1, [&](std::size_t chunk, std::size_t, std::size_t) { chunk == 0 ? first() : second(); });
}

int available_cores() {
  return std::max(1, tbb::info::default_concurrency());
}

}  // namespace lpdeform
