#pragma once

#include <chrono>
#include <optional>
#include <random>

#include "absl/status/status.h"
#include "lpdeform/v1/service.pb.h"

namespace lpdeform::client {

/// What to do when a stream has ended.
enum class NextStep {
  kResume,    // open a stream to the same session
  kMakeAnew,  // the session is gone: make it from our copy, then open a stream
  kGiveUp,
};

struct Recovery {
  NextStep next = NextStep::kGiveUp;
  /// Why the stream ended: what the caller is told where we give up.
  absl::Status why;
  /// Not to be tried before this has passed.
  std::chrono::milliseconds pause{0};
};

/// Decides by the go-away message, where one came, or by the status that the call ended with.
/// `has_copy`: the session can be made anew.
Recovery recovery_after(const absl::Status& ended, const std::optional<v1::GoAway>& go_away, bool has_copy);

/// Growing pauses between attempts: 50 ms doubled up to 5 s, each between half and the whole of that by
/// chance, so that clients of a restarted server do not all come at once.
class Backoff {
 public:
  std::chrono::milliseconds next();
  void reset() { longest_ = kFirst; }

  static constexpr std::chrono::milliseconds kMost{5000};

 private:
  static constexpr std::chrono::milliseconds kFirst{50};
  std::chrono::milliseconds longest_ = kFirst;
  std::minstd_rand chance_{std::random_device{}()};
};

}  // namespace lpdeform::client
