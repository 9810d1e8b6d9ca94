#include "server/access/listener.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <utility>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/strip.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform {
namespace {

constexpr int kUnacknowledgedMs = 20'000;
/// How often ended connections are counted, at most.
constexpr std::chrono::milliseconds kBetweenCounts{10};
/// The pause between two tries to accept a connection while there are no file descriptors.
constexpr std::chrono::milliseconds kPause{50};

absl::Status not_bound(const std::string& address, const std::string& why) {
  return make_fault({Reason::kAddressNotBound, address, ""},
                    absl::StrCat("The server cannot listen on ", address, ": ", why, "."));
}

absl::Status not_bound_now(const std::string& address) {
  return not_bound(address, std::strerror(errno));
}

bool is_loopback(const sockaddr& address) {
  if (address.sa_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(address);
    return (ntohl(v4.sin_addr.s_addr) >> 24) == 127;
  }
  const auto& v6 = reinterpret_cast<const sockaddr_in6&>(address);
  if (IN6_IS_ADDR_V4MAPPED(&v6.sin6_addr)) return v6.sin6_addr.s6_addr[12] == 127;
  return IN6_IS_ADDR_LOOPBACK(&v6.sin6_addr) != 0;
}

/// Different for each socket of the system; 0 for a closed descriptor.
std::uint64_t inode_of(int fd) {
  struct stat about {};
  return fstat(fd, &about) == 0 ? about.st_ino : 0;
}

/// Identifies a connection's peer: the bytes of a host's address, or of its IPv6 network of 64 bits, because
/// hosts choose their addresses within it. Empty for Unix sockets.
std::string peer_of(const sockaddr_storage& from) {
  if (from.ss_family == AF_INET) {
    const auto& v4 = reinterpret_cast<const sockaddr_in&>(from);
    return {reinterpret_cast<const char*>(&v4.sin_addr), sizeof(v4.sin_addr)};
  }
  if (from.ss_family != AF_INET6) return "";
  const in6_addr& v6 = reinterpret_cast<const sockaddr_in6&>(from).sin6_addr;
  const auto* const bytes = reinterpret_cast<const char*>(v6.s6_addr);
  return IN6_IS_ADDR_V4MAPPED(&v6) ? std::string(bytes + 12, 4) : std::string(bytes, 8);
}

int port_of(int socket) {
  sockaddr_storage bound{};
  socklen_t size = sizeof(bound);
  if (getsockname(socket, reinterpret_cast<sockaddr*>(&bound), &size) != 0) return 0;
  return ntohs(bound.ss_family == AF_INET ? reinterpret_cast<sockaddr_in&>(bound).sin_port
                                          : reinterpret_cast<sockaddr_in6&>(bound).sin6_port);
}

/// Raises the limit of file descriptors to `wanted` if that is allowed, and returns the limit.
int raise_descriptor_limit(int wanted) {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return 1024;
  if (limit.rlim_cur < static_cast<rlim_t>(wanted)) {
    rlimit raised = limit;
    raised.rlim_cur = std::min(limit.rlim_max, static_cast<rlim_t>(wanted));
    if (setrlimit(RLIMIT_NOFILE, &raised) == 0) limit = raised;
  }
  return static_cast<int>(std::min<rlim_t>(limit.rlim_cur, 1 << 30));
}

}  // namespace

absl::StatusOr<std::unique_ptr<Listener>> Listener::bind(const std::string& address) {
  std::unique_ptr<Listener> listener(new Listener);
  listener->address_ = address;
  listener->wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  absl::string_view rest = address;
  absl::Status status;
  if (absl::ConsumePrefix(&rest, "unix:")) {
    status = listener->bind_path(std::string(rest));
  } else if (const std::size_t colon = address.rfind(':'); colon != std::string::npos) {
    status = listener->bind_host(address.substr(0, colon), address.substr(colon + 1));
  } else {
    status = not_bound(address, "it is neither HOST:PORT nor unix:/PATH");
  }
  if (!status.ok()) return status;
  return listener;
}

absl::Status Listener::bind_path(const std::string& path) {
  sockaddr_un where{};
  where.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof(where.sun_path)) {
    return not_bound(address_, absl::StrCat("a path has 1 to ", sizeof(where.sun_path) - 1, " bytes"));
  }
  std::memcpy(where.sun_path, path.data(), path.size());
  struct stat there {};
  if (stat(path.c_str(), &there) == 0 && S_ISSOCK(there.st_mode)) unlink(path.c_str());
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (socket < 0) return not_bound_now(address_);
  sockets_.push_back(socket);
  if (::bind(socket, reinterpret_cast<const sockaddr*>(&where), sizeof(where)) != 0)
    return not_bound_now(address_);
  path_ = path;
  return listen(socket, SOMAXCONN) == 0 ? absl::OkStatus() : not_bound_now(address_);
}

absl::Status Listener::bind_host(const std::string& host, const std::string& port) {
  std::string name(absl::StripSuffix(absl::StripPrefix(host, "["), "]"));
  int number = 0;
  if (!absl::SimpleAtoi(port, &number) || number < 0 || number > 65535) {
    return not_bound(address_, "a port is a number up to 65535");
  }
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* found = nullptr;
  if (const int error = getaddrinfo(name.empty() ? nullptr : name.c_str(), port.c_str(), &hints, &found);
      error != 0) {
    return not_bound(address_, gai_strerror(error));
  }
  const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> infos(found, freeaddrinfo);
  absl::Status status;
  for (const addrinfo* info = found; info != nullptr && status.ok(); info = info->ai_next) {
    if (info->ai_family != AF_INET && info->ai_family != AF_INET6) continue;
    status = add_socket(*info, sockets_.empty() ? 0 : port_of(sockets_.front()));
  }
  if (!status.ok()) return status;
  if (sockets_.empty()) return not_bound(address_, "the host has no address");
  address_ = absl::StrCat(host, ":", port_of(sockets_.front()));
  return absl::OkStatus();
}

/// `port`, if it is not 0, replaces port 0 of the address.
absl::Status Listener::add_socket(const addrinfo& info, int port) {
  sockaddr_storage where{};
  std::memcpy(&where, info.ai_addr, info.ai_addrlen);
  in_port_t& wanted = info.ai_family == AF_INET ? reinterpret_cast<sockaddr_in&>(where).sin_port
                                                : reinterpret_cast<sockaddr_in6&>(where).sin6_port;
  if (wanted == 0) wanted = htons(static_cast<in_port_t>(port));
  const int socket = ::socket(info.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  // A machine without IPv6 may still have names for IPv6 addresses.
  if (socket < 0) return errno == EAFNOSUPPORT ? absl::OkStatus() : not_bound_now(address_);
  const int yes = 1;
  setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
  if (info.ai_family == AF_INET6) setsockopt(socket, IPPROTO_IPV6, IPV6_V6ONLY, &yes, sizeof(yes));
  if (::bind(socket, reinterpret_cast<const sockaddr*>(&where), info.ai_addrlen) != 0) {
    const bool is_absent = errno == EADDRNOTAVAIL && info.ai_family == AF_INET6;
    const absl::Status status = not_bound_now(address_);
    close(socket);
    return is_absent ? absl::OkStatus() : status;
  }
  sockets_.push_back(socket);
  if (listen(socket, SOMAXCONN) != 0) return not_bound_now(address_);
  if (!is_loopback(*info.ai_addr)) is_local_ = false;
  return absl::OkStatus();
}

std::size_t Listener::start(const Limits& limits, Events events) {
  events_ = std::move(events);
  const int first = dup(wake_);  // the lowest free descriptor
  if (first >= 0) close(first);
  limits_ = limits;
  limits_.connections = std::min<std::size_t>(limits.connections, 1 << 20);
  const int limit =
      raise_descriptor_limit(first + static_cast<int>(limits_.connections) + 2 * limits_.spare_descriptors);
  last_descriptor_ = limit - std::min(limits_.spare_descriptors, (limit - first) / 4);
  thread_ = std::thread([this] { run(); });
  return std::min(limits_.connections, static_cast<std::size_t>(std::max(last_descriptor_ - first, 0)));
}

/// gRPC does not report when a connection has ended. But then its descriptor is closed, or belongs to another
/// file.
bool Listener::has_room(const std::string& peer) {
  if (has_room_now(peer)) return true;
  const auto now = std::chrono::steady_clock::now();
  if (now - counted_at_ < kBetweenCounts) return false;
  counted_at_ = now;
  forget_ended();
  return has_room_now(peer);
}

bool Listener::has_room_now(const std::string& peer) const {
  if (given_.size() >= limits_.connections) return false;
  const auto theirs = from_.find(peer);
  return limits_.per_address == 0 || peer.empty() || theirs == from_.end() ||
         theirs->second < limits_.per_address;
}

void Listener::forget_ended() {
  std::erase_if(given_, [](const auto& one) { return inode_of(one.first) != one.second.inode; });
  from_.clear();
  for (const auto& one : given_) ++from_[one.second.peer];
}

void Listener::run() {
  std::vector<pollfd> ready;
  for (const int socket : sockets_) ready.push_back({socket, POLLIN, 0});
  ready.push_back({wake_, POLLIN, 0});
  while (!is_stopping_) {
    if (poll(ready.data(), ready.size(), -1) < 0 && errno != EINTR) return;
    if (is_stopping_) return;
    for (const pollfd& one : ready) {
      if (one.fd != wake_ && (one.revents & POLLIN) != 0) accept_from(one.fd);
    }
  }
}

/// A new descriptor is the lowest free one, so a high one means that all below are taken.
void Listener::accept_from(int listening) {
  sockaddr_storage from{};
  socklen_t size = sizeof(from);
  const int fd = accept4(listening, reinterpret_cast<sockaddr*>(&from), &size, SOCK_CLOEXEC | SOCK_NONBLOCK);
  if (fd < 0) {
    const bool is_full = errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM;
    if (is_full) std::this_thread::sleep_for(kPause);  // the connection waits in the system's queue
    return;
  }
  const std::string peer = peer_of(from);
  if (fd >= last_descriptor_ || !has_room(peer)) {
    ++refused_;
    close(fd);
    events_.on_refused();
    return;
  }
  const int yes = 1, patience = kUnacknowledgedMs;
  setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof(yes));
  setsockopt(fd, IPPROTO_TCP, TCP_USER_TIMEOUT, &patience, sizeof(patience));
  // If a descriptor comes again, the connection that had it before has ended.
  if (const auto before = given_.find(fd); before != given_.end()) --from_[before->second.peer];
  given_[fd] = {inode_of(fd), peer};
  ++from_[peer];
  ++accepted_;
  events_.on_connection(listening, fd);
}

void Listener::stop() {
  if (is_stopping_.exchange(true)) return;
  const std::uint64_t one = 1;
  if (write(wake_, &one, sizeof(one)) < 0) return;  // cannot fail: the counter is at 0
  if (thread_.joinable()) thread_.join();
  for (const int socket : sockets_) close(socket);
  sockets_.clear();
  if (!path_.empty()) unlink(path_.c_str());
}

Listener::~Listener() {
  stop();
  close(wake_);
}

}  // namespace lpdeform
