#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace lpdeform::engine {

/// INVALID_ARGUMENT ARGUMENT_MISSING.
absl::Status argument_missing(const std::string& name);

/// INVALID_ARGUMENT ENUM_UNKNOWN where `value` is not within 0 to `most`.
absl::Status check_enum(const std::string& name, std::int32_t value, std::int32_t most);

}  // namespace lpdeform::engine
