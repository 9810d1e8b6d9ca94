#pragma once

#include <chrono>
#include <string>

namespace lpdeform {

/// What a call brings along beside its request.
struct CallContext {
  /// Of the caller's traceparent header; empty where there is none.
  std::string trace_id = {};
  /// The header "authorization". Never logged.
  std::string authorization = {};
  /// Whom the client's certificate names; empty where none was asked for.
  std::string peer_identity = {};
  /// Whom the caller thinks it speaks to: HTTP's Host.
  std::string authority = {};
  /// The header "lpdeform-session", by which a proxy chose this server; empty where there is none.
  std::string route = {};
  /// Whether one of these two came more than once: which was meant is not known, and it is empty above.
  bool is_authorization_doubled = false, is_route_doubled = false;
  /// By when the client wants the call to be over, and how long that was when it came; long from now where it did not say.
  struct Deadline {
    std::chrono::system_clock::time_point when = std::chrono::system_clock::time_point::max();
    std::chrono::system_clock::duration given{0};
  };
  Deadline deadline = {};
};

}  // namespace lpdeform
