#pragma once

#include <string>

#include "absl/status/status.h"

namespace lpdeform::client {

/// OK for HOST:PORT with a port from 1 to 65535, unix:PATH, and the other schemes that gRPC knows (dns:, ipv4:, ipv6:, xds:, ...), which
/// it looks at itself. Errors: INVALID_ARGUMENT ADDRESS_INVALID. Without this, a port above 65535 would reach another one.
absl::Status check_address(const std::string& address);

}  // namespace lpdeform::client
