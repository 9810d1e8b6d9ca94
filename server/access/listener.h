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

/// Takes connections for gRPC and hands them over. gRPC's own listener never takes one again after file descriptors ran
/// out once (CVE-2023-4785, gRPC 1.51), and knows no limit; this one refuses connections before they run out, and goes
/// on after they did.
class Listener {
 public:
  /// Binds: "host:port", port 0 for a free one, on every address that the host has; or "unix:/path", in place of a socket
  /// that was left there. Does not take connections yet. UNAVAILABLE ADDRESS_NOT_BOUND.
  static absl::StatusOr<std::unique_ptr<Listener>> bind(const std::string& address);
  ~Listener();

  /// With the port that was found.
  const std::string& address() const { return address_; }
  /// Whether only this machine can reach it: loopback, or a Unix socket.
  bool is_local() const { return is_local_; }

  struct Events {
    /// A connection, from the listener's thread. Whoever is called owns `fd`.
    std::function<void(int listener_fd, int fd)> on_connection;
    /// One was closed at once for want of room.
    std::function<void()> on_refused;
  };
  struct Limits {
    std::size_t connections = 1;  // at a time
    /// Of them, from one address: a host's, or an IPv6 network's of 64 bits. 0: without limit, as for Unix sockets.
    std::size_t per_address = 0;
    /// That the rest of the process may need; of a low limit of descriptors, at most a quarter.
    int spare_descriptors = 96;
  };
  /// Takes connections from now on, within `limits`. Raises the process's limit of descriptors for
  /// that; returns how many there can be within it. Once.
  std::size_t start(const Limits& limits, Events events);

  /// Connections handed over so far.
  std::uint64_t accepted() const { return accepted_; }
  /// And closed at once for want of room.
  std::uint64_t refused() const { return refused_; }

  /// Takes no more. Again: nothing.
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
  int last_descriptor_ = 0;  // from here on they are not for connections
  // The listener's thread alone:
  struct Given {
    std::uint64_t inode = 0;
    std::string peer;
  };
  std::unordered_map<int, Given> given_;               // connections handed over, by their descriptors
  std::unordered_map<std::string, std::size_t> from_;  // how many of each peer
  std::chrono::steady_clock::time_point counted_at_;
  std::atomic<std::uint64_t> accepted_ = 0, refused_ = 0;
  std::atomic<bool> is_stopping_ = false;
  std::thread thread_;
};

}  // namespace lpdeform
