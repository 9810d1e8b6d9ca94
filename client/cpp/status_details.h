#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace lpdeform::client {

/// The error of a call, with the reason, element and limit that its google.rpc.Status (`details`, serialised)
/// carries in a google.rpc.ErrorInfo, for fault_of. Details that cannot be read are left out.
absl::Status with_details(absl::StatusCode code, std::string_view text, const std::string& details);

}  // namespace lpdeform::client
