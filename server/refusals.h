#pragma once

#include "core/base/fault.h"

namespace lpdeform {

/// UNAVAILABLE DRAINING.
inline absl::Status server_draining() {
  return make_fault(absl::StatusCode::kUnavailable, {"DRAINING", "", ""}, "The server is shutting down.");
}

/// RESOURCE_EXHAUSTED SERVER_BUSY.
inline absl::Status server_busy() {
  return make_fault(absl::StatusCode::kResourceExhausted, {"SERVER_BUSY", "calls", ""},
                    "The server has too many calls waiting; try again later.");
}

}  // namespace lpdeform
