#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <utility>

#include "absl/status/status.h"
#include "lpdeform/v1/service.pb.h"

namespace lpdeform::client {

/// What to do when a stream has ended.
enum class NextStep {
  kResume,    // open a stream to the same session
  kRecreate,  // the session is lost: create it from our copy, then open a stream
  kGiveUp,
};

struct Recovery {
  NextStep next = NextStep::kGiveUp;
  /// Why the stream ended; returned to the caller if we give up.
  absl::Status why;
  /// The pause that the server asks for; no attempt before it has passed.
  std::chrono::milliseconds asked{0};
  /// The time to wait: `asked` plus our own growing pause.
  std::chrono::milliseconds pause{0};
};

/// Exponential backoff with jitter between attempts. The longest pause starts at 50 ms and doubles up to 2 s; each
/// pause is a random share, from half to all, of it, so that the clients of a restarted server do not all reconnect at
/// once.
class Backoff {
 public:
  using Chance = std::function<double()>;  // a random number from 0 to 1
  static constexpr std::chrono::milliseconds kMost{2000};
  /// The longest pause that a server may ask for.
  static constexpr std::chrono::milliseconds kMostAsked{60'000};

  explicit Backoff(Chance chance = {}) : chance_(std::move(chance)) {}

  /// The next pause, in addition to `asked`, the pause that the server asks for (at most kMostAsked).
  std::chrono::milliseconds next(std::chrono::milliseconds asked = {});
  void reset() { longest_ = kFirst; }

 private:
  static constexpr std::chrono::milliseconds kFirst{50};
  std::chrono::milliseconds longest_ = kFirst;
  Chance chance_;
};

/// How a stream ended.
struct Ending {
  absl::Status status;
  std::optional<v1::GoAway> go_away;   // the server's reason, if it gave one; takes precedence over `status`
  std::chrono::milliseconds stood{0};  // how long the stream was open
  std::chrono::milliseconds away{0};   // time since a stream was last open
};

/// Decides what a session does after each of its streams. tests/golden/recovery.json has the rules as a table; the
/// clients in all languages are tested with it. Not thread-safe.
class RecoveryRules {
 public:
  /// How many streams in a row may end because of malformed frames before we conclude that the server has an
  /// incompatible version.
  static constexpr int kMostMisfits = 5;

  /// `has_copy`: the session can be created again. Gives up after `reconnect_for` without an open stream.
  RecoveryRules(bool has_copy, std::chrono::milliseconds reconnect_for, Backoff backoff = Backoff())
      : has_copy_(has_copy), reconnect_for_(reconnect_for), backoff_(std::move(backoff)) {}

  Recovery after(const Ending& ending);
  /// What to do after the session could not be created again.
  Recovery after_failed_making(const absl::Status& failed);
  /// A complete frame arrived.
  void frame_fitted() { misfits_ = 0; }
  /// Starts again: earlier failures no longer count.
  void begin();

 private:
  Recovery with_pause(NextStep next, absl::Status why, std::chrono::milliseconds asked);

  const bool has_copy_;
  const std::chrono::milliseconds reconnect_for_;
  Backoff backoff_;
  int misfits_ = 0;
};

/// What an error means for the update that it answers, or for the update in a call.
enum class Answer {
  kAgain,     // send it again, after retry_after()
  kRecreate,  // it waits until the session is created again
  kTaken,     // the server has accepted it but cannot solve for it yet
  kRefused,
};

/// `is_second`: this update had the same answer before.
Answer answer_of(const absl::Status& status, bool is_second = false);

}  // namespace lpdeform::client
