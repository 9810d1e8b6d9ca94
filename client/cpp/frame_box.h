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

/// Where frames wait for the caller: the newest one only, and at most kMostProblems errors. Thread-safe.
class FrameBox {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kMostProblems = 16;

  struct Taken {
    Frame frame;
    std::uint64_t stream = 0;
  };

  /// Takes in a frame that came on stream number `stream`. False, and dropped, where its epoch is over or it
  /// answers an older update than one that was in the box before.
  bool put(Frame frame, std::uint64_t stream);

  /// An error that the next take() hands out; the oldest is dropped where there are too many.
  void put_problem(absl::Status problem);

  /// Frames of earlier epochs are void from now on, one that waits in the box too.
  void begin_epoch(std::uint64_t epoch);
  /// A session made anew counts its epochs from anywhere.
  void begin_session();

  /// Nothing more comes; once the box is empty, take() says why.
  void finish(absl::Status why);
  /// Why nothing more comes; OK while something may.
  absl::Status end() const;
  /// Undoes finish(). What was taken before is forgotten: another writer may have been there since.
  void resume();

  /// Waits until `deadline` for an error, a frame or the end. Empty where none came.
  absl::StatusOr<std::optional<Taken>> take(Clock::time_point deadline);
  /// The same without taking anything. False where there was nothing.
  bool wait(Clock::time_point deadline);
  /// The same, and ends with true as soon as take() has handed out more than `takes` frames and errors.
  bool wait(Clock::time_point deadline, std::uint64_t takes);

  /// How many frames and errors take() has handed out.
  std::uint64_t takes() const;
  /// The frame that take() handed out last, where that one was final.
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
