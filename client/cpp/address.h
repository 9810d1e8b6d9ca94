#pragma once

#include <string>

#include "absl/status/status.h"

namespace lpdeform::client {

/// Accepts HOST:PORT with a port from 1 to 65535, unix:PATH, and addresses with other gRPC schemes (dns:, ipv4:, ipv6:,
/// xds:, ...), which gRPC checks itself. Errors: INVALID_ARGUMENT ADDRESS_INVALID. Without this check, a port above
/// 65535 would connect to another port.
absl::Status check_address(const std::string& address);

}  // namespace lpdeform::client
