#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace lpdeform {

/// The value with a checksum (CRC-32C) before it: over the value and where it belongs, so that one cannot stand in for another.
std::string sealed(const std::string& session, const std::string& part, const std::string& value);

/// The value again. NOT_FOUND SESSION_DAMAGED.
absl::StatusOr<std::string> unsealed(const std::string& session, const std::string& part, std::string bytes);

}  // namespace lpdeform
