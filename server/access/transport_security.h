#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "server/access/certificates.h"

namespace lpdeform {

/// Secures each new connection with the contents of `certificates` in force at that time. Null: plain text.
std::shared_ptr<grpc::ServerCredentials> make_credentials(const std::shared_ptr<Certificates>& certificates);

}  // namespace lpdeform
