#pragma once

#include "absl/status/status.h"
#include "client/cpp/client.h"

namespace lpdeform::client {

/// Checks that the texts are certificates and a matching key. With wrong texts, gRPC would only fail to connect for
/// ever. INVALID_ARGUMENT TLS_CERTIFICATES, TLS_PRIVATE_KEY, TLS_KEY_MISSING, TLS_KEY_MISMATCH.
absl::Status check_tls(const Tls& tls);

}  // namespace lpdeform::client
