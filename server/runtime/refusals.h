#pragma once

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <string>

#include "absl/status/status.h"
#include "absl/strings/cord.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {

inline constexpr char kRetryPayload[] = "lpdeform/retry_after_ms";

/// The same error with a time to retry after: 1 ms to an hour from now.
inline absl::Status retry_after(absl::Status error, std::chrono::duration<double> wait) {
  const double ms = std::clamp(std::ceil(1e3 * wait.count()), 1.0, 3.6e6);
  error.SetPayload(kRetryPayload, absl::Cord(absl::StrCat(static_cast<std::uint32_t>(ms))));
  return error;
}

/// After how many milliseconds a caller should retry; 0 if a retry does not help.
inline std::uint32_t retry_after_ms(const absl::Status& error) {
  std::uint32_t ms = 0;
  if (const auto payload = error.GetPayload(kRetryPayload);
      payload && absl::SimpleAtoi(std::string(*payload), &ms)) {
    return ms;
  }
  if (absl::IsUnavailable(error)) return 1000;
  if (absl::IsResourceExhausted(error)) return 5000;
  return 0;
}

/// UNAVAILABLE DRAINING.
inline absl::Status server_draining() {
  return make_fault({Reason::kDraining, "", ""}, "The server is shutting down.");
}

/// NOT_FOUND SESSION_UNKNOWN.
inline absl::Status session_unknown() {
  return make_fault({Reason::kSessionUnknown, "session", ""},
                    "There is no such session; it may have expired or been deleted.");
}

/// UNAVAILABLE SESSION_ELSEWHERE. `header`: that of calls which reach the other server; empty if there is none, or it is not known.
/// `advice`: ends the sentence, and says what to do.
inline absl::Status session_elsewhere(const std::string& header = "",
                                      const std::string& advice = "try again.") {
  return make_fault({Reason::kSessionElsewhere, "session", header},
                    absl::StrCat("Another server has the session; ", advice));
}

/// RESOURCE_EXHAUSTED SERVER_BUSY. `wait`: until the calls that wait now have had their turn.
inline absl::Status server_busy(std::chrono::duration<double> wait) {
  return retry_after(make_fault({Reason::kServerBusy, "calls", ""},
                                "The server has too many calls waiting; try again after the time given."),
                     wait);
}

}  // namespace lpdeform
