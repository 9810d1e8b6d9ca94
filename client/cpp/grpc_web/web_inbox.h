#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <utility>

#include "absl/status/status.h"

namespace lpdeform::client {

/// What a call receives, until its reader takes it. Thread-safe.
template <typename T>
class Inbox {
 public:
  /// From so many bytes on, those of the items' own objects included, there is no room until the reader has taken some.
  static constexpr std::size_t kMostBytes = 8 << 20;

  bool has_room() {
    const std::scoped_lock lock(mutex_);
    is_full_ = bytes_ >= kMostBytes;
    return !is_full_;
  }

  /// `bytes`: what `item` holds besides its own object.
  void put(T item, std::size_t bytes) {
    const std::scoped_lock lock(mutex_);
    if (end_) return;
    items_.emplace_back(std::move(item), sizeof(T) + bytes);
    bytes_ += sizeof(T) + bytes;
    changed_.notify_all();
  }

  /// Nothing comes after this; only the first end counts.
  void end(absl::Status status) {
    const std::scoped_lock lock(mutex_);
    if (!end_) end_ = std::move(status);
    changed_.notify_all();
  }

  /// Waits for the next item; empty after the last. Calls `resume` if there is room again after has_room() was false.
  std::optional<T> take(const std::function<void()>& resume) {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return !items_.empty() || end_; });
    if (items_.empty()) return std::nullopt;
    auto [item, bytes] = std::move(items_.front());
    items_.pop_front();
    bytes_ -= bytes;
    const bool has_room_again = is_full_ && bytes_ < kMostBytes;
    if (has_room_again) is_full_ = false;
    lock.unlock();
    if (has_room_again) resume();
    return std::move(item);
  }

  /// The status of end(); OK before.
  absl::Status status() const {
    const std::scoped_lock lock(mutex_);
    return end_.value_or(absl::OkStatus());
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::pair<T, std::size_t>> items_;
  std::size_t bytes_ = 0;
  bool is_full_ = false;
  std::optional<absl::Status> end_;
};

}  // namespace lpdeform::client
