#pragma once

#include "absl/status/status.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::client {

/// FAILED_PRECONDITION SESSION_CLOSED: of a call after close(), and of one that close() ends.
inline absl::Status session_closed() {
  return make_fault({Reason::kSessionClosed, "", ""}, "The session is closed.");
}

}  // namespace lpdeform::client
