#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/calls/options.h"

namespace lpdeform {

/// The service, running: from start() until drain() or the destructor. Thread-safe.
class Server {
 public:
  /// Errors: INVALID_ARGUMENT OPTION_OUT_OF_RANGE, ANONYMOUS_ADDRESS, TLS_FILES, TOKEN_KEYS; UNAVAILABLE
  /// ADDRESS_NOT_BOUND.
  static absl::StatusOr<std::unique_ptr<Server>> start(const ServerOptions& given);

  /// Drains, waiting for nobody.
  ~Server();

  /// For clients: as in the options, with the port that was found.
  const std::string& address() const;
  /// Of the admin port; empty where there is none.
  std::string admin_address() const;

  /// Stops: health says NOT_SERVING, new calls are refused as UNAVAILABLE, streams get a go-away, Solve calls
  /// may go on until `grace` has passed and are ended then; then a store that fails has 5 s more to take what has changed. Returns when
  /// nothing runs any more: true where the store has all that was answered; else the log has a line for each session ("session_not_kept").
  /// Again: the same, at once. `on_flushed`: called, with what is to be returned, once the store is waited for no more. What comes after
  /// may still need it to answer: calls that read, and the destructor.
  using OnFlushed = std::function<void(bool is_all_kept)>;
  bool drain(std::chrono::milliseconds grace, const OnFlushed& on_flushed = nullptr);

 private:
  struct Impl;
  explicit Server(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace lpdeform
