#pragma once

#include <string>

namespace lpdeform {

/// Files in PEM. All empty: plain text. They are checked every two seconds, so certificates can be renewed
/// while the server runs.
struct TlsFiles {
  std::string certificate_chain;  // the server's own first
  std::string private_key;
  std::string client_authorities;  // if set, clients must show a certificate that one of these signed

  bool is_on() const {
    return !certificate_chain.empty() || !private_key.empty() || !client_authorities.empty();
  }
  bool knows_clients() const { return !client_authorities.empty(); }
};

}  // namespace lpdeform
