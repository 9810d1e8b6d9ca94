#pragma once

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
};

}  // namespace lpdeform
