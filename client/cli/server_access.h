#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "client/cpp/client.h"

namespace lpdeform::cli {

/// The server's address, and what is needed to be admitted.
struct ServerAccess {
  std::optional<std::string> address;  // not set: a server in this process
  bool tls = false;
  std::string tls_ca, tls_cert, tls_key;  // files in PEM; each of them switches TLS on
  std::string token_file;
};

/// Reads the files. The token is read again for each call, so it may be renewed. Calls to a server in this
/// process have no deadline; Ctrl-C ends them. NOT_FOUND FILE_NOT_FOUND; INVALID_ARGUMENT TOKEN_FILE if that
/// file is not one line of text.
absl::StatusOr<client::ClientOptions> client_options(const ServerAccess& access);

}  // namespace lpdeform::cli
