#include "server/call_record.h"

#include <utility>

#include "core/base/fault.h"
#include "server/session.h"

namespace lpdeform {
namespace {

/// Errors whose texts speak of the server or of the caller's rights, never of what was sent.
bool is_of_the_server(absl::StatusCode code) {
  return code == absl::StatusCode::kUnavailable || code == absl::StatusCode::kResourceExhausted ||
         code == absl::StatusCode::kUnauthenticated || code == absl::StatusCode::kPermissionDenied ||
         code == absl::StatusCode::kInternal;
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
  if (!status.ok()) refused(status);
}

void CallRecord::about(const std::shared_ptr<const Session>& session) {
  const std::scoped_lock lock(mutex_);
  session_ = session;
}

void CallRecord::refused(const absl::Status& status) const {
  const std::string reason = fault_of(status).reason;
  if (reason.empty()) return;  // the client's own doing
  metrics_->rejected(reason);
  const std::string text = is_of_the_server(status.code()) ? std::string(status.message()) : "";
  std::shared_ptr<const Session> session;
  {
    const std::scoped_lock lock(mutex_);
    session = session_.lock();
  }
  if (session == nullptr) {
    return log_->info(
        "refused",
        {{"method", method_}, {"reason", reason}, {"text", text}, {"trace_id", context_.trace_id}});
  }
  const WriterLease lease = session->lease();
  log_->info("refused", {{"method", method_},
                         {"session", abbreviated(session->name())},
                         {"epoch", lease.epoch},
                         {"input_seq", lease.input_seq},
                         {"reason", reason},
                         {"text", text},
                         {"trace_id", context_.trace_id}});
}

}  // namespace lpdeform
