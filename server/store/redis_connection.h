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

/// What Redis answers.
struct RedisReply {
  bool is_nothing = false;  // nil
  std::int64_t number = 0;
  std::string text;  // of strings and statuses
  std::vector<RedisReply> elements;
};

/// Who one is to a Redis that asks.
struct RedisLogin {
  std::string user = {};           // empty: the one of a Redis that knows a password alone
  std::string password_file = {};  // its first line; empty: it does not ask
};

/// A connection to a Redis server, made anew after a failure, when it is next needed. For one thread at a time. Errors are
/// UNAVAILABLE STORE_FAILING, store_away() where nothing answers; whether the commands were carried out is not known then. The password is read again with each
/// connection, and in no text.
class RedisConnection {
 public:
  RedisConnection(std::string host, int port, std::chrono::milliseconds patience, RedisLogin login = {});
  ~RedisConnection();

  using Command = std::vector<std::string>;

  absl::StatusOr<RedisReply> run(const Command& command);
  /// Sends all, then reads the answers: one journey.
  absl::StatusOr<std::vector<RedisReply>> run(const std::vector<Command>& commands);

  /// After this moment nothing is waited for any more; by another thread, too, which then need not wait for this one.
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
