#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace lpdeform {

/// How many lines a log takes of one kind, whoever causes them, until it is summed up: so nobody can fill a disk by it, or push
/// what matters out of sight. What is left out is counted. Not thread-safe.
class LogBound {
 public:
  /// Lines of one event, reason and session; lines of one event and reason over all sessions.
  static constexpr std::size_t kOfASession = 10, kOfAReason = 200;

  /// What a line is told from others by. Events and reasons are closed sets; sessions may be any number.
  struct Kind {
    int level = 0;
    std::string event, reason, session;
  };
  struct LeftOut {
    Kind kind;  // without a session: of all those that are not listed by themselves
    std::uint64_t count = 0;
  };

  /// Whether a line of this kind may be written. It counts as one, either way.
  bool admits(const Kind& kind);

  /// What has been left out since the last time, and begins anew.
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
