#pragma once

#include <chrono>
#include <string>

namespace lpdeform {

/// What comes with a call besides its request.
struct CallContext {
  /// From the caller's traceparent header; empty if there is none.
  std::string trace_id = {};
  /// The header "authorization". Never logged.
  std::string authorization = {};
  /// The subject of the client's certificate; empty if none was required.
  std::string peer_identity = {};
  /// The host that the caller means to reach: HTTP's Host.
  std::string authority = {};
  /// The header "lpdeform-session", by which a proxy chose this server; empty if there is none.
  std::string route = {};
  /// Whether one of these two headers came more than once. Then its value is ambiguous, and empty above.
  bool is_authorization_doubled = false, is_route_doubled = false;
  /// When the client wants the call to end, and how long it allowed when the call came. Far in the future if
  /// it set no deadline.
  struct Deadline {
    std::chrono::system_clock::time_point when = std::chrono::system_clock::time_point::max();
    std::chrono::system_clock::duration given{0};
  };
  Deadline deadline = {};
};

}  // namespace lpdeform
