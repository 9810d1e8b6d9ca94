#pragma once

#include <cstdint>
#include <string>

#include "absl/status/status.h"

namespace lpdeform::engine {

/// INVALID_ARGUMENT ARGUMENT_MISSING.
absl::Status argument_missing(const std::string& name);

/// INVALID_ARGUMENT ENUM_UNKNOWN if `value` is not in [0, most].
absl::Status check_enum(const std::string& name, std::int32_t value, std::int32_t most);

/// INVALID_ARGUMENT RESERVED_SET if a reserved field is not 0: a later library may give it a meaning.
absl::Status check_reserved(const std::string& name, std::uint32_t value);

}  // namespace lpdeform::engine
