#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

struct redisContext;

namespace lpdeform {

/// An answer of Redis.
struct RedisReply {
  bool is_nothing = false;  // nil
  std::int64_t number = 0;
  std::string text;  // of strings and statuses
  std::vector<RedisReply> elements;
};

/// The user name and password for Redis.
struct RedisLogin {
  std::string user = {};           // empty: Redis's default user
  std::string password_file = {};  // the password is its first line; empty: Redis needs none
};

/// A connection to a Redis server. After a failure it is opened again when it is next needed. For one thread
/// at a time. Errors are UNAVAILABLE STORE_FAILING, and store_away() if nothing answers; in both cases the
/// commands may or may not have been carried out. The password is read again for each connection and appears
/// in no text.
class RedisConnection {
 public:
  RedisConnection(std::string host, int port, std::chrono::milliseconds patience, RedisLogin login = {});
  ~RedisConnection();

  using Command = std::vector<std::string>;

  absl::StatusOr<RedisReply> run(const Command& command);
  /// Sends all commands, then reads the answers: one round trip.
  absl::StatusOr<std::vector<RedisReply>> run(const std::vector<Command>& commands);

  /// Sets a deadline: after `end` the connection waits for nothing any more. May be called by another thread,
  /// which then need not wait for this one.
  void end_by(std::chrono::steady_clock::time_point end) { end_ = end; }

 private:
  std::chrono::milliseconds time_left() const;
  absl::Status connect();
  absl::Status log_in();
  absl::StatusOr<std::vector<RedisReply>> send(const std::vector<Command>& commands);
  std::string place() const;
  absl::Status failure(const std::string& what);
  absl::Status no_answer(const std::string& what);

  struct Free {
    void operator()(redisContext* context) const;
  };
  const std::string host_;
  const int port_;
  const std::chrono::milliseconds patience_;
  const RedisLogin login_;
  std::unique_ptr<redisContext, Free> context_;
  std::atomic<std::chrono::steady_clock::time_point> end_{std::chrono::steady_clock::time_point::max()};
};

}  // namespace lpdeform
