#pragma once

#include <filesystem>
#include <fstream>
#include <string>

#include <unistd.h>

#include "tests/client/in_process_server.h"
#include "tests/server/fixtures/token_maker.h"

namespace lpdeform::client {

/// A server that takes the tokens of one pair of keys.
class TokenServer {
 public:
  TokenServer() : server_(options()) {}
  ~TokenServer() { std::filesystem::remove(keys_); }

  std::string address() const { return server_.address(); }
  std::string token() const { return maker_.token_of("a game"); }

 private:
  ServerOptions options() const {
    std::ofstream(keys_) << maker_.public_key();
    ServerOptions options;
    options.token_keys_file = keys_;
    return options;
  }

  const std::filesystem::path keys_ =
      std::filesystem::temp_directory_path() / ("lpdeform-token-server-" + std::to_string(getpid()));
  const TokenMaker maker_;
  const InProcessServer server_;
};

}  // namespace lpdeform::client
