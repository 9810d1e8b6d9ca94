#pragma once

#include <grpcpp/security/server_credentials.h>

#include <memory>

#include "server/access/certificates.h"

namespace lpdeform {

/// How connections are secured: each new one by what is in force of `certificates` then. Null: plain text.
std::shared_ptr<grpc::ServerCredentials> make_credentials(const std::shared_ptr<Certificates>& certificates);

}  // namespace lpdeform
