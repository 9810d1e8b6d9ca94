#pragma once

#include <string>

#include "absl/status/statusor.h"

namespace lpdeform::client {

/// Where requests go.
struct Origin {
  std::string url;     // http://HOST:PORT or https://HOST:PORT
  std::string socket;  // the path of a Unix socket, or empty
};

/// `address`: HOST:PORT, http://HOST[:PORT], https://HOST[:PORT] or unix:PATH. Without a scheme it is https if `has_tls`,
/// otherwise http. INVALID_ARGUMENT ADDRESS_INVALID for others, and for http:// if `has_tls`.
absl::StatusOr<Origin> origin_of(const std::string& address, bool has_tls);

}  // namespace lpdeform::client
