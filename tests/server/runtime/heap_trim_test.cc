#include "server/runtime/heap_trim.h"

#include <gtest/gtest.h>

#include <malloc.h>

#include <atomic>
#include <future>
#include <vector>

namespace lpdeform {
namespace {

using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""h;

TEST(HeapTrim, TrimsOnceForAllThatWasReleasedInAPause) {
  std::atomic<int> count = 0;
  std::promise<void> first, second;
  HeapTrim heap(100ms, [&] {
    if (++count == 1) first.set_value();
    if (count == 2) second.set_value();
  });
  for (int k = 0; k < 1000; ++k) heap.after_release();
  first.get_future().wait();
  EXPECT_EQ(count, 1);
  heap.after_release();
  second.get_future().wait();
  EXPECT_EQ(count, 2);
}

TEST(HeapTrim, DoesNotKeepItsOwnerWaiting) {
  bool is_trimmed = false;
  {
    HeapTrim heap(1h, [&] { is_trimmed = true; });
    heap.after_release();
  }
  EXPECT_FALSE(is_trimmed);
}

TEST(HeapTrim, GivesTheSystemWhatTheAllocatorKeeps) {
  // Freed in the middle of the heap, so that the allocator keeps it by itself.
  std::vector<void*> pieces;
  for (int k = 0; k < 4000; ++k) pieces.push_back(std::malloc(16384));
  void* const last = std::malloc(16384);
  const auto kept = [] { return mallinfo2().fordblks; };
  for (void* const piece : pieces) std::free(piece);
  const std::size_t before = kept();
  std::promise<int> returned;
  HeapTrim heap(1ms, [&] { returned.set_value(malloc_trim(0)); });
  heap.after_release();
  EXPECT_EQ(returned.get_future().get(), 1) << before;
  std::free(last);
}

}  // namespace
}  // namespace lpdeform
