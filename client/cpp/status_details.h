#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace lpdeform::client {

/// The error of a call, with the reason, element and limit that its google.rpc.Status (`details`, serialised) carries
/// in a google.rpc.ErrorInfo, for fault_of, and the pause of its google.rpc.RetryInfo, for retry_after. Details that
/// cannot be parsed are ignored.
absl::Status with_details(absl::StatusCode code, std::string_view text, const std::string& details);

/// The same error with a pause for retry_after().
absl::Status with_retry_after(absl::Status status, std::chrono::milliseconds pause);

}  // namespace lpdeform::client
