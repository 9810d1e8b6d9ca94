#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/c/live_session.h"
#include "client/cpp/client.h"

namespace lpdeform::engine {

/// A server as the C interface knows it: connected to when it is first needed, by the threads of its sessions,
/// which share the connection. Functions may be called from any thread.
class Server : public std::enable_shared_from_this<Server> {
 public:
  /// Makes a session with a client that is connected; waits.
  using Open = std::function<absl::StatusOr<client::Session>(client::Client&, const std::stop_token&)>;

  /// `options.token` is not used: see set_token.
  Server(std::string address, client::ClientOptions options, double reconnect_seconds);

  /// INVALID_ARGUMENT TOKEN_CHARACTERS; the token in force stays then.
  absl::Status set_token(std::string token);

  std::shared_ptr<LiveSession> start(Open open, LiveSession::Facts facts);

  /// Closes every session, gives up those that are being opened, and waits for the ends of their threads: as long as one call
  /// may take at most.
  void close();

 private:
  absl::StatusOr<client::Client> connected(const std::stop_token& stop);
  void forget_closed();

  struct Token {
    std::mutex mutex;
    std::string text;
  };

  const std::string address_;
  client::ClientOptions options_;
  const double reconnect_seconds_;
  const std::shared_ptr<Token> token_ = std::make_shared<Token>();

  std::mutex connecting_;  // one thread at a time connects, the others wait for what it finds
  std::optional<client::Client> client_;

  std::mutex mutex_;
  std::vector<std::shared_ptr<LiveSession>> sessions_;  // all that have a thread
};

}  // namespace lpdeform::engine
