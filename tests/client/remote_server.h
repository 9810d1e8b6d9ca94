#pragma once

#include <map>
#include <string>

namespace lpdeform::client {

/// A server in the program serve_tests, for programs that cannot have one in themselves, because they are for another system.
/// serve_tests has started this program.
class RemoteServer {
 public:
  /// `kind`: one that serve_tests has, and what it may be told: "real&tls=1".
  explicit RemoteServer(const std::string& kind);
  ~RemoteServer();
  RemoteServer(const RemoteServer&) = delete;
  RemoteServer& operator=(const RemoteServer&) = delete;

  const std::string& address() const { return address_; }

  /// What the server answers to one of the questions that serve_tests has for its kind.
  std::string ask(const std::string& question) const;

 private:
  std::string id_, address_;
};

// The classes of the same names in in_process_server.h, token_server.h and lying_server.h, each behind Envoy.

enum class Transport { kPlain, kTls };

class InProcessServer : public RemoteServer {
 public:
  explicit InProcessServer(Transport transport = Transport::kPlain)
      : RemoteServer(transport == Transport::kTls ? "real&tls=1" : "real") {}
  std::string root_certificates() const { return ask("roots"); }
  void stop() { ask("stop"); }
  void start_again() { ask("start"); }
};

class TokenServer : public RemoteServer {
 public:
  TokenServer() : RemoteServer("tokens") {}
  std::string token() const { return ask("token"); }
};

using Lies = std::map<std::string, int>;

class LyingServer : public RemoteServer {
 public:
  explicit LyingServer(const Lies& lies) : RemoteServer("lies" + query_of(lies)) {}
  void stop() { ask("stop"); }
  int creations() const { return std::stoi(ask("creations")); }
  int deletions() const { return std::stoi(ask("deletions")); }
  int takings() const { return std::stoi(ask("takings")); }

 private:
  static std::string query_of(const Lies& lies) {
    std::string query;
    for (const auto& [name, number] : lies) query += "&" + name + "=" + std::to_string(number);
    return query;
  }
};

class SilentServer : public RemoteServer {
 public:
  SilentServer() : RemoteServer("silence") {}
};

}  // namespace lpdeform::client
