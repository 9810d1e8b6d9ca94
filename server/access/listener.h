#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "absl/status/statusor.h"

struct addrinfo;

namespace lpdeform {

/// Accepts connections for gRPC and hands them over. gRPC's own listener stops for good after file
/// descriptors have run out once (CVE-2023-4785, gRPC 1.51), and has no limit of connections. This one
/// refuses connections before descriptors run out, and continues afterwards.
class Listener {
 public:
  /// Binds an address: "host:port" on every address that the host has, port 0 for a free one; or
  /// "unix:/path", replacing a socket that was left there. Does not accept connections yet. UNAVAILABLE
  /// ADDRESS_NOT_BOUND.
  static absl::StatusOr<std::unique_ptr<Listener>> bind(const std::string& address);
  ~Listener();

  /// The address with the port that was bound.
  const std::string& address() const { return address_; }
  /// Whether only this machine can reach it: a loopback address or a Unix socket.
  bool is_local() const { return is_local_; }

  struct Events {
    /// A new connection, on the listener's thread. The callee owns `fd`.
    std::function<void(int listener_fd, int fd)> on_connection;
    /// A connection was closed at once because a limit was reached.
    std::function<void()> on_refused;
  };
  struct Limits {
    std::size_t connections = 1;  // at a time
    /// Limit per peer address: that of a host, or of an IPv6 network of 64 bits. 0: without limit, as for
    /// Unix sockets.
    std::size_t per_address = 0;
    /// Descriptors left for the rest of the process; at most a quarter of the process's limit.
    int spare_descriptors = 96;
  };
  /// Begins to accept connections, within `limits`. Raises the process's limit of descriptors for that.
  /// Returns how many connections there can be. Call it once.
  std::size_t start(const Limits& limits, Events events);

  /// Connections handed over so far.
  std::uint64_t accepted() const { return accepted_; }
  /// Connections closed at once because a limit was reached.
  std::uint64_t refused() const { return refused_; }

  /// Stops accepting. A second call does nothing.
  void stop();

 private:
  Listener() = default;
  absl::Status bind_path(const std::string& path);
  absl::Status bind_host(const std::string& host, const std::string& port);
  absl::Status add_socket(const addrinfo& info, int port);
  void run();
  void accept_from(int listening);
  bool has_room(const std::string& peer);
  bool has_room_now(const std::string& peer) const;
  void forget_ended();

  std::string address_;
  std::string path_;  // of a Unix socket
  bool is_local_ = true;
  std::vector<int> sockets_;
  int wake_ = -1;
  Events events_;
  Limits limits_;
  int last_descriptor_ = 0;  // descriptors from here on are not for connections
  // Used by the listener's thread only:
  struct Given {
    std::uint64_t inode = 0;
    std::string peer;
  };
  std::unordered_map<int, Given> given_;               // connections handed over, by their descriptors
  std::unordered_map<std::string, std::size_t> from_;  // connections per peer
  std::chrono::steady_clock::time_point counted_at_;
  std::atomic<std::uint64_t> accepted_ = 0, refused_ = 0;
  std::atomic<bool> is_stopping_ = false;
  std::thread thread_;
};

}  // namespace lpdeform
