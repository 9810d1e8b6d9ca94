#include "server/call_record.h"

#include <utility>

#include "core/base/fault.h"

namespace lpdeform {

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

void CallRecord::refused(const absl::Status& status) const {
  const std::string reason = fault_of(status).reason;
  if (reason.empty()) return;  // the client's own doing
  metrics_->rejected(reason);
  log_->info("refused", {{"method", method_},
                         {"reason", reason},
                         {"text", std::string(status.message())},
                         {"trace_id", context_.trace_id}});
}

}  // namespace lpdeform
