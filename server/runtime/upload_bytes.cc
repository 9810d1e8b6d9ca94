#include "server/runtime/upload_bytes.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstring>
#include <iterator>

namespace lpdeform {
namespace {

/// Reserves addresses without memory behind them; null if the system has none. Huge pages are off: a page of
/// 2 MiB would take more than is counted.
char* map_without_memory(std::uint64_t size) {
  void* const data =
      mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (data == MAP_FAILED) return nullptr;
  madvise(data, size, MADV_NOHUGEPAGE);  // a kernel without huge pages refuses this
  return static_cast<char*>(data);
}

/// The size of the pages that hold so many bytes (at most a step).
std::uint64_t in_pages(std::uint64_t bytes) {
  return (bytes + UploadBytes::kPage - 1) / UploadBytes::kPage * UploadBytes::kPage;
}

}  // namespace

void UploadBytes::Unmap::operator()(char* data) const {
  munmap(data, size);
}

/// How many runs the bytes from `begin` to `end` touch or overlap.
std::size_t UploadBytes::runs_joined(std::uint64_t begin, std::uint64_t end) const {
  const auto first = runs_.upper_bound(begin);
  const bool joins_one_before = first != runs_.begin() && std::prev(first)->second >= begin;
  const auto joined = std::distance(first, runs_.upper_bound(end));
  return static_cast<std::size_t>(joined) + (joins_one_before ? 1 : 0);
}

bool UploadBytes::has_some(std::uint64_t begin, std::uint64_t end) const {
  const auto after = runs_.lower_bound(end);
  return after != runs_.begin() && std::prev(after)->second > begin;
}

std::size_t UploadBytes::memory_with(std::uint64_t begin, std::uint64_t count) const {
  return memory_of(steps_memory_with(begin, count), runs_.size() + 1 - runs_joined(begin, begin + count));
}

std::size_t UploadBytes::steps_memory_with(std::uint64_t begin, std::uint64_t count) const {
  std::size_t memory = steps_memory_;
  const std::uint64_t last = (begin + count - 1) / kStep;
  for (std::uint64_t step = begin / kStep; step <= last; ++step) {
    const std::uint64_t from = step * kStep, to = from + std::min(kStep, size_ - from);
    if (!has_some(from, to)) memory += in_pages(to - from);
  }
  return memory;
}

bool UploadBytes::put(std::uint64_t begin, std::string_view part) {
  if (data_ == nullptr) data_.reset(map_without_memory(size_));
  if (data_ == nullptr) return false;
  steps_memory_ = steps_memory_with(begin, part.size());
  std::memcpy(data_.get() + begin, part.data(), part.size());
  mark(begin, begin + part.size());
  return true;
}

void UploadBytes::mark(std::uint64_t begin, std::uint64_t end) {
  auto run = runs_.upper_bound(begin);
  if (run != runs_.begin() && std::prev(run)->second >= begin) run = std::prev(run);
  while (run != runs_.end() && run->first <= end) {
    begin = std::min(begin, run->first);
    end = std::max(end, run->second);
    received_ -= run->second - run->first;
    run = runs_.erase(run);
  }
  runs_.emplace(begin, end);
  received_ += end - begin;
}

void UploadBytes::clear() {
  data_.reset();
  runs_.clear();
  received_ = 0;
  steps_memory_ = 0;
}

}  // namespace lpdeform
