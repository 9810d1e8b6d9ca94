#pragma once

#include "absl/status/status.h"
#include "client/cpp/client.h"

namespace lpdeform::client {

/// Whether the texts are what they are said to be. gRPC would only find no way to the server, for ever. INVALID_ARGUMENT
/// TLS_CERTIFICATES, TLS_PRIVATE_KEY, TLS_KEY_MISSING, TLS_KEY_MISMATCH.
absl::Status check_tls(const Tls& tls);

}  // namespace lpdeform::client
