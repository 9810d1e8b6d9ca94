#pragma once

#include <string_view>

#include "absl/status/status.h"
#include "client/cpp/types.h"

namespace lpdeform::client {

/// INVALID_ARGUMENT NAME_ENCODING where a text that is to travel is not UTF-8: nobody could parse the message that has it.
/// `what` is for the error: "handle".
absl::Status check_name(std::string_view what, std::string_view name);

/// The same of the handles of an update.
absl::Status check_names(const Update& update);

}  // namespace lpdeform::client
