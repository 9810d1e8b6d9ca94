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
  kMakeAnew,  // the session is gone: make it from our copy, then open a stream
  kGiveUp,
};

struct Recovery {
  NextStep next = NextStep::kGiveUp;
  /// Why the stream ended: what the caller is told where we give up.
  absl::Status why;
  /// Not to be tried before this has passed: what the server asks for.
  std::chrono::milliseconds asked{0};
  /// To be waited for: that, and a growing pause of ours.
  std::chrono::milliseconds pause{0};
};

/// Growing pauses between attempts: 50 ms doubled up to 2 s, each between half and the whole of that by
/// chance, so that clients of a restarted server do not all come at once.
class Backoff {
 public:
  using Chance = std::function<double()>;  // from 0 to 1
  static constexpr std::chrono::milliseconds kMost{2000};
  /// The longest pause that a server may ask for.
  static constexpr std::chrono::milliseconds kMostAsked{60'000};

  explicit Backoff(Chance chance = {}) : chance_(std::move(chance)) {}

  /// On top of `asked`, what the server asks for.
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
  std::optional<v1::GoAway> go_away;   // the server's reason, where it gave one; goes before `status`
  std::chrono::milliseconds stood{0};  // for which the stream was open
  std::chrono::milliseconds away{0};   // since a stream was open last
};

/// What a session does after each of its streams. tests/golden/recovery.json has the rules as a table, which the clients in all
/// languages replay. Not thread-safe.
class RecoveryRules {
 public:
  /// Streams in a row that may end by something that does not fit, before it is taken to be of another version.
  static constexpr int kMostMisfits = 5;

  /// `has_copy`: the session can be made anew. Gives up after `reconnect_for` without an open stream.
  RecoveryRules(bool has_copy, std::chrono::milliseconds reconnect_for, Backoff backoff = Backoff())
      : has_copy_(has_copy), reconnect_for_(reconnect_for), backoff_(std::move(backoff)) {}

  Recovery after(const Ending& ending);
  /// After the session could not be made anew.
  Recovery after_failed_making(const absl::Status& failed);
  /// A whole frame came.
  void frame_fitted() { misfits_ = 0; }
  /// Another try is meant: what went wrong before does not count.
  void begin();

 private:
  Recovery with_pause(NextStep next, absl::Status why, std::chrono::milliseconds asked);

  const bool has_copy_;
  const std::chrono::milliseconds reconnect_for_;
  Backoff backoff_;
  int misfits_ = 0;
};

/// What an error says of the update that it answers, or that a call was made with.
enum class Answer {
  kAgain,     // it is to be sent again, not before retry_after()
  kMakeAnew,  // it waits for the session made anew
  kTaken,     // the server has it and cannot solve for it yet
  kRefused,
};

/// `is_second`: this update had the same answer before.
Answer answer_of(const absl::Status& status, bool is_second = false);

}  // namespace lpdeform::client
