#pragma once

#include <string>
#include <string_view>

#include "absl/status/status.h"

namespace lpdeform {

/// `handle "tip"`, for messages. A long name is cut to its first 128 bytes.
std::string handle_element(std::string_view name);

/// HANDLE_NAME: a name has 1 to 128 bytes.
absl::Status check_handle_name(std::string_view name);

}  // namespace lpdeform
