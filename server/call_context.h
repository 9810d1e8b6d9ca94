#pragma once

#include <string>

namespace lpdeform {

/// What a call brings along beside its request.
struct CallContext {
  /// Of the caller's traceparent header; empty where there is none.
  std::string trace_id;
};

}  // namespace lpdeform
