#pragma once

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "absl/status/status.h"
#include "server/calls/call_context.h"
#include "server/calls/call_gate.h"
#include "server/runtime/log.h"
#include "server/runtime/metrics.h"

namespace lpdeform {

class Session;

/// What was refused, if that is known.
struct RefusedInput {
  std::uint64_t input_seq = 0;  // of the update
  std::string handle = {};      // the only handle that it concerns
};

/// One call from its arrival to its end: lets it through the gate, measures it, and logs why it was refused.
/// Thread-safe.
class CallRecord {
 public:
  struct Services {
    CallGate& gate;
    std::shared_ptr<Metrics> metrics;
    std::shared_ptr<const Log> log;
  };

  /// `method`: "lpdeform.v1.DeformService/Solve".
  CallRecord(const Services& services, std::string method, CallContext context);
  /// The call is over. If ended() was not called, it counts as cancelled.
  ~CallRecord();

  /// False if the server drains.
  bool is_let_in() const { return permit_ != nullptr; }
  const CallContext& context() const { return context_; }

  void received(std::size_t bytes) { received_ += bytes; }
  void sent(std::size_t bytes) { sent_ += bytes; }

  /// Sets the session of the call, once it is known to be the caller's.
  void about(const std::shared_ptr<const Session>& session);
  void about(RefusedInput input);

  /// Sets how the call ended; call it once.
  void ended(const absl::Status& status);
  /// Something in the call was refused, and the call goes on. The log gets the error's text only if it is
  /// about the server: a text about the caller's input may quote its coordinates. In that case the log has
  /// only the element and the limit.
  void refused(const absl::Status& status, const RefusedInput& input) const;

 private:
  void tell(const absl::Status& status, const std::string& reason, const RefusedInput& input) const;

  const CallGate::Permit permit_;
  const std::shared_ptr<Metrics> metrics_;
  const std::shared_ptr<const Log> log_;
  const std::string method_;
  const CallContext context_;
  mutable std::mutex mutex_;
  std::weak_ptr<const Session> session_;
  RefusedInput input_;
  const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  std::atomic<absl::StatusCode> code_ = absl::StatusCode::kCancelled;
  std::atomic<std::size_t> received_ = 0;
  std::atomic<std::size_t> sent_ = 0;
};

}  // namespace lpdeform
