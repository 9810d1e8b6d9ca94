#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace lpdeform {

/// The value with a checksum (CRC-32C) before it. The checksum covers the value, the session and the part's
/// name, so that one part cannot be taken for another.
std::string sealed(const std::string& session, const std::string& part, const std::string& value);

/// The value without its checksum. NOT_FOUND SESSION_DAMAGED.
absl::StatusOr<std::string> unsealed(const std::string& session, const std::string& part, std::string bytes);

}  // namespace lpdeform
