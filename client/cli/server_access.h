#pragma once

#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "client/cpp/client.h"

namespace lpdeform::cli {

/// Where the server is, and how to be let in.
struct ServerAccess {
  std::optional<std::string> address;  // a server in this process where there is none
  bool tls = false;
  std::string tls_ca, tls_cert, tls_key;  // files in PEM; any of them switches TLS on
  std::string token_file;
};

/// Reads the files; that of the token again for each call, so that it may be renewed. No call of the server in this process runs
/// out of time: what it is asked for it does, and Ctrl-C ends it. NOT_FOUND FILE_NOT_FOUND;
/// INVALID_ARGUMENT TOKEN_FILE where it is not one line of text.
absl::StatusOr<client::ClientOptions> client_options(const ServerAccess& access);

}  // namespace lpdeform::cli
