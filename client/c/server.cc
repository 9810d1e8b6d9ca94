#include "client/c/server.h"

#include <utility>

#include "client/cpp/caller.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::engine {

Server::Server(std::string address, client::ClientOptions options, double reconnect_seconds)
    : address_(std::move(address)), options_(std::move(options)), reconnect_seconds_(reconnect_seconds) {}

absl::Status Server::set_token(std::string token) {
  if (!client::is_header_text(token)) {
    return make_fault(
        {Reason::kTokenCharacters, "token", "printable ASCII"},
        "The token has a character that a header cannot carry; a line break at its end, perhaps.");
  }
  const std::scoped_lock lock(token_->mutex);
  token_->text = std::move(token);
  return absl::OkStatus();
}

absl::StatusOr<client::Client> Server::connected(const std::stop_token& stop) {
  const std::scoped_lock lock(connecting_);
  if (client_) return *client_;
  if (stop.stop_requested()) return absl::CancelledError("Connecting was stopped.");
  client::ClientOptions options = options_;
  options.token = [token = token_] {
    const std::scoped_lock lock(token->mutex);
    return token->text;
  };
  absl::StatusOr<client::Client> made = client::Client::connect(address_, std::move(options), stop);
  if (made.ok()) client_ = *made;
  return made;
}

std::shared_ptr<LiveSession> Server::start(Open open, LiveSession::Facts facts) {
  facts.reconnect_seconds = reconnect_seconds_;
  auto session = std::make_shared<LiveSession>(
      [self = shared_from_this(),
       open = std::move(open)](const std::stop_token& stop) -> absl::StatusOr<client::Session> {
        absl::StatusOr<client::Client> client = self->connected(stop);
        if (!client.ok()) return client.status();
        return open(*client, stop);
      },
      facts);
  forget_closed();
  const std::scoped_lock lock(mutex_);
  sessions_.push_back(session);
  return session;
}

/// Removes closed sessions. Their threads have ended, so this does not wait.
void Server::forget_closed() {
  const std::scoped_lock lock(mutex_);
  std::erase_if(sessions_, [](const auto& session) { return session->is_closed(); });
}

void Server::close() {
  std::vector<std::shared_ptr<LiveSession>> sessions;
  {
    const std::scoped_lock lock(mutex_);
    sessions.swap(sessions_);
  }
  for (const auto& session : sessions) session->stop();
  for (const auto& session : sessions) session->wait_until_closed();
}

}  // namespace lpdeform::engine
