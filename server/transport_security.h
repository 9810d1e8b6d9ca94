#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "absl/status/statusor.h"
#include "server/tls_files.h"

namespace lpdeform {

/// How connections are secured. INVALID_ARGUMENT TLS_FILES where a file is missing or cannot be used.
absl::StatusOr<std::shared_ptr<grpc::ServerCredentials>> make_credentials(const TlsFiles& files);

}  // namespace lpdeform
