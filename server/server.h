#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/calls/options.h"

namespace lpdeform {

/// A running service: from start() until drain() or the destructor. Thread-safe.
class Server {
 public:
  /// Errors: INVALID_ARGUMENT OPTION_OUT_OF_RANGE, ANONYMOUS_ADDRESS, TLS_FILES, TOKEN_KEYS; UNAVAILABLE
  /// ADDRESS_NOT_BOUND.
  static absl::StatusOr<std::unique_ptr<Server>> start(const ServerOptions& given);

  /// Drains without a grace period.
  ~Server();

  /// The address for clients: the one in the options, with the port that was bound.
  const std::string& address() const;
  /// The address of the admin port; empty if there is none.
  std::string admin_address() const;

  /// Stops the service. Health reports NOT_SERVING, new calls are refused as UNAVAILABLE, and streams get a
  /// go-away. Solve calls may run until `grace` has passed and are then ended. After that a failing store has
  /// 5 s more to take the changes. Returns when nothing runs any more: true if the store has everything that
  /// was answered. Otherwise the log has a line for each session ("session_not_kept"). A second call returns
  /// the same result at once.
  /// `on_flushed` is called with the result once the service waits for the store no longer. Calls that read
  /// and the destructor may still need an answer from the store after that.
  using OnFlushed = std::function<void(bool is_all_kept)>;
  bool drain(std::chrono::milliseconds grace, const OnFlushed& on_flushed = nullptr);

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lpdeform
