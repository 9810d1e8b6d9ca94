#include "server/calls/call_record.h"

#include <utility>

#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "server/session/session.h"

namespace lpdeform {
namespace {

bool is_servers_fault(absl::StatusCode code) {
  return code == absl::StatusCode::kInternal || code == absl::StatusCode::kUnknown ||
         code == absl::StatusCode::kDataLoss;
}

/// Data with a wrong checksum is the fault of its sender or of the network, although the code is DATA_LOSS. A
/// caller can cause any number of these errors.
bool is_servers_fault(const absl::Status& status, const std::string& reason) {
  return is_servers_fault(status.code()) && reason != Reason::kUploadChecksum;
}

/// Errors whose texts are about the server or the caller's rights, never about the caller's input.
bool is_of_the_server(absl::StatusCode code) {
  return code == absl::StatusCode::kUnavailable || code == absl::StatusCode::kResourceExhausted ||
         code == absl::StatusCode::kUnauthenticated || code == absl::StatusCode::kPermissionDenied ||
         is_servers_fault(code);
}

/// An unknown name may be anything, also a token in the wrong place, so only the start of it is logged.
std::string element_of(const Fault& fault) {
  return fault.reason == Reason::kSessionUnknown ? abbreviated(fault.element) : in_quotes(fault.element);
}

/// The limit of a distance is computed from the mesh, which must not be logged.
std::string limit_of(const Fault& fault) {
  return fault.reason.ends_with("_TOO_FAR") ? "" : in_quotes(fault.limit);
}

}  // namespace

CallRecord::CallRecord(const Services& services, std::string method, CallContext context)
    : permit_(services.gate.enter()),
      metrics_(services.metrics),
      log_(services.log),
      method_(std::move(method)),
      context_(std::move(context)) {
  metrics_->call_started(method_);
}

CallRecord::~CallRecord() {
  const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - began_;
  metrics_->call_ended({method_, absl::StatusCodeToString(code_), spent.count(), static_cast<double>(sent_),
                        static_cast<double>(received_)});
}

void CallRecord::ended(const absl::Status& status) {
  code_ = status.code();
  if (status.ok()) return;
  RefusedInput input;
  {
    const std::scoped_lock lock(mutex_);
    input = input_;
  }
  refused(status, input);
}

void CallRecord::about(const std::shared_ptr<const Session>& session) {
  const std::scoped_lock lock(mutex_);
  session_ = session;
}

void CallRecord::about(RefusedInput input) {
  const std::scoped_lock lock(mutex_);
  input_ = std::move(input);
}

void CallRecord::refused(const absl::Status& status, const RefusedInput& input) const {
  std::string reason = fault_of(status).reason;
  if (reason.empty()) {
    if (!is_servers_fault(status.code())) return;  // the client's own fault
    reason = absl::StatusCodeToString(status.code());
  }
  metrics_->rejected(reason);
  tell(status, reason, input);
}

void CallRecord::tell(const absl::Status& status, const std::string& reason,
                      const RefusedInput& input) const {
  std::shared_ptr<const Session> session;
  {
    const std::scoped_lock lock(mutex_);
    session = session_.lock();
  }
  const WriterLease lease = session ? session->lease() : WriterLease{};
  const Fault fault = fault_of(status);
  const auto write = is_servers_fault(status, reason) ? &Log::error : &Log::info;
  ((*log_).*write)("refused", {{"method", method_},
                               {"session", session ? abbreviated(session->name()) : ""},
                               {"epoch", where_known(lease.epoch)},
                               {"session_input_seq", where_known(lease.input_seq)},
                               {"input_seq", where_known(input.input_seq)},
                               {"handle", in_quotes(input.handle)},
                               {"reason", reason},
                               {"element", element_of(fault)},
                               {"limit", limit_of(fault)},
                               {"text", is_of_the_server(status.code()) ? std::string(status.message()) : ""},
                               {"trace_id", context_.trace_id}});
}

}  // namespace lpdeform
