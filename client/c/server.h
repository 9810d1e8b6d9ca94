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

/// A server of the C interface. The threads of its sessions connect to it when it is first needed, and share the
/// connection. Thread-safe.
class Server : public std::enable_shared_from_this<Server> {
 public:
  /// Creates a session with a connected client; waits.
  using Open = std::function<absl::StatusOr<client::Session>(client::Client&, const std::stop_token&)>;

  /// `options.token` is ignored: see set_token.
  Server(std::string address, client::ClientOptions options, double reconnect_seconds);

  /// INVALID_ARGUMENT TOKEN_CHARACTERS; the previous token then stays in force.
  absl::Status set_token(std::string token);

  std::shared_ptr<LiveSession> start(Open open, LiveSession::Facts facts);

  /// Closes every session, aborts openings that are under way, and waits until all their threads have ended: at most as
  /// long as one call may take.
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

  std::mutex connecting_;  // one thread at a time connects, the others wait for its result
  std::optional<client::Client> client_;

  std::mutex mutex_;
  std::vector<std::shared_ptr<LiveSession>> sessions_;  // all sessions that have a thread
};

}  // namespace lpdeform::engine
