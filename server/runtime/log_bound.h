#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace lpdeform {

/// Limits how many lines of one kind the log takes before it sums them up. So no caller can fill a disk with
/// log lines or bury important ones. Lines left out are counted. Not thread-safe.
class LogBound {
 public:
  /// Limits: lines per event, reason and session; lines per event and reason over all sessions.
  static constexpr std::size_t kOfASession = 10, kOfAReason = 200;

  /// What tells lines apart. Events and reasons are closed sets; there may be any number of sessions.
  struct Kind {
    int level = 0;
    std::string event, reason, session;
  };
  struct LeftOut {
    Kind kind;  // without a session: the sum of all sessions that are not listed separately
    std::uint64_t count = 0;
  };

  /// Whether a line of this kind may be written. Counts the line in either case.
  bool admits(const Kind& kind);

  /// Returns what was left out since the last call, and resets the counts.
  std::vector<LeftOut> take();

 private:
  struct Count {
    std::size_t written = 0;
    std::uint64_t left_out = 0;
  };
  struct Lines {
    int level = 0;  // the highest
    Count all;
    std::map<std::string, Count> of_sessions;  // at most kOfAReason
  };
  std::map<std::pair<std::string, std::string>, Lines> lines_;  // by event and reason
};

}  // namespace lpdeform
