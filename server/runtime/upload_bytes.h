#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string_view>

namespace lpdeform {

/// A buffer of known size whose bytes come in parts, in any order. Only the steps that have received bytes
/// take memory, however large the size is. The memory comes from the system page by page as it is written,
/// and goes back to it at once. For one thread at a time.
class UploadBytes {
 public:
  /// Bytes whose memory is counted together. The last step may be shorter, by whole pages.
  static constexpr std::uint64_t kStep = 64u << 10;
  /// The smallest piece of memory that the system gives.
  static constexpr std::uint64_t kPage = 4096;
  /// Memory for the bounds of a run, counted for each run but the first.
  static constexpr std::size_t kRunBytes = 64;

  explicit UploadBytes(std::uint64_t size) : size_(size), data_(nullptr, Unmap{size}) {}

  std::uint64_t size() const { return size_; }
  /// How many bytes have come.
  std::uint64_t received() const { return received_; }
  /// The number of stretches without gaps in which they lie.
  std::size_t runs() const { return runs_.size(); }
  /// Whether the bytes from `begin` to `end` touch or overlap bytes that are there, so that no new run
  /// begins.
  bool joins_a_run(std::uint64_t begin, std::uint64_t end) const { return runs_joined(begin, end) != 0; }

  /// Bytes of memory in use; falls when two runs become one.
  std::size_t memory() const { return memory_of(steps_memory_, runs_.size()); }
  /// memory() as it would be after `count` more bytes from `begin` on: 1 or more, within the size.
  std::size_t memory_with(std::uint64_t begin, std::uint64_t count) const;

  /// Adds a part, which must lie within the size and must not be empty. Returns false and changes nothing if
  /// the system has no memory for it.
  bool put(std::uint64_t begin, std::string_view part);
  /// All bytes, with zeros where none have come. Valid after the first part, until clear().
  std::string_view whole() const { return {data_.get(), size_}; }

  /// Forgets all bytes.
  void clear();

 private:
  struct Unmap {
    std::uint64_t size;
    void operator()(char* data) const;
  };
  static std::size_t memory_of(std::size_t steps_memory, std::size_t runs) {
    return steps_memory + kRunBytes * (runs - (runs == 0 ? 0 : 1));
  }
  std::size_t runs_joined(std::uint64_t begin, std::uint64_t end) const;
  bool has_some(std::uint64_t begin, std::uint64_t end) const;
  std::size_t steps_memory_with(std::uint64_t begin, std::uint64_t count) const;
  void mark(std::uint64_t begin, std::uint64_t end);

  const std::uint64_t size_;
  std::unique_ptr<char, Unmap> data_;  // null before the first part
  // Begin and end of each run; runs neither touch nor overlap.
  std::map<std::uint64_t, std::uint64_t> runs_;
  std::uint64_t received_ = 0;
  std::size_t steps_memory_ = 0;
};

}  // namespace lpdeform
