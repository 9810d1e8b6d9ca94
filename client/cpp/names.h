#pragma once

#include <string_view>

#include "absl/status/status.h"
#include "client/cpp/types.h"

namespace lpdeform::client {

/// INVALID_ARGUMENT NAME_ENCODING if `name` is not UTF-8: no receiver could parse a message that contains it. `what`
/// names the kind of text in the error: "handle".
absl::Status check_name(std::string_view what, std::string_view name);

/// The same for the handles of an update.
absl::Status check_names(const Update& update);

}  // namespace lpdeform::client
