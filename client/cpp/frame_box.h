#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cpp/types.h"

namespace lpdeform::client {

/// Holds the newest frame, and at most kMostProblems errors, until the caller takes them. Thread-safe.
class FrameBox {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMostProblems = 16;

  struct Taken {
    Frame frame;
    std::uint64_t stream = 0;
  };

  /// Stores a frame from stream number `stream`, replacing an older one. Drops the frame and returns false if its epoch
  /// is over, or if it is for an older update than an earlier frame.
  bool put(Frame frame, std::uint64_t stream);

  /// Stores an error for take() to return. If there are too many, the oldest is dropped.
  void put_problem(absl::Status problem);

  /// From now on, frames of earlier epochs are void, including one that waits in the box.
  void begin_epoch(std::uint64_t epoch);
  /// Begins a new session, whose epochs may start at any number.
  void begin_session();

  /// No more frames arrive. When the box is empty, take() returns `why`.
  void finish(absl::Status why);
  /// The error of finish(); OK if it was not called.
  absl::Status end() const;
  /// Undoes finish(). Forgets the last final frame, because there may have been another writer since.
  void resume();

  /// Waits until `deadline` for an error, a frame or the end. Empty on timeout.
  absl::StatusOr<std::optional<Taken>> take(Clock::time_point deadline);
  /// Waits in the same way without taking anything. False on timeout.
  bool wait(Clock::time_point deadline);
  /// The same, but also returns true as soon as takes() exceeds `takes`.
  bool wait(Clock::time_point deadline, std::uint64_t takes);

  /// The number of frames and errors that take() has returned.
  std::uint64_t takes() const;
  /// Whether an error waits for take().
  bool has_problem() const;
  /// The frame that take() returned last, if it was final.
  std::optional<Frame> last_final() const;

 private:
  bool has_something() const { return newest_ || !problems_.empty() || end_; }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t epoch_ = 0;
  std::uint64_t input_seq_ = 0;
  std::optional<Taken> newest_;
  std::optional<Frame> last_final_;
  std::uint64_t takes_ = 0;
  std::deque<absl::Status> problems_;
  std::optional<absl::Status> end_;
};

}  // namespace lpdeform::client
