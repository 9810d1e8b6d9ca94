#include "server/admin/grpc_log.h"

#ifdef LPDEFORM_GRPC_HAS_LOG_FUNCTION
#include <grpc/support/log.h>
#else
#include "absl/log/globals.h"
#include "absl/log/initialize.h"
#include "absl/log/log_entry.h"
#include "absl/log/log_sink.h"
#include "absl/log/log_sink_registry.h"
#endif

#include <mutex>
#include <string>
#include <string_view>

namespace lpdeform {
namespace {

std::mutex mutex;
std::weak_ptr<const Log>& taker() {
  static auto* const log = new std::weak_ptr<const Log>;  // threads of gRPC outlive main
  return *log;
}

void pass_on(bool is_error, std::string_view path, int line_number) {
  std::shared_ptr<const Log> log;
  {
    const std::scoped_lock lock(mutex);
    log = taker().lock();
  }
  if (log == nullptr) return;
  const std::size_t slash = path.rfind('/');
  const std::string file(path.substr(slash == std::string_view::npos ? 0 : slash + 1));
  const auto line = static_cast<std::uint64_t>(line_number);
  if (is_error) return log->warning("grpc", {{"file", file}, {"line", line}});
  log->debug("grpc", {{"file", file}, {"line", line}});
}

#ifdef LPDEFORM_GRPC_HAS_LOG_FUNCTION
void begin() {}

void redirect() {
  gpr_set_log_function([](gpr_log_func_args* args) {
    pass_on(args->severity == GPR_LOG_SEVERITY_ERROR, args->file, args->line);
  });
}
#else
/// Newer gRPC logs by Abseil, as protobuf does.
class Sink final : public absl::LogSink {
  void Send(const absl::LogEntry& entry) override {
    pass_on(entry.log_severity() >= absl::LogSeverity::kError, entry.source_filename(), entry.source_line());
  }
};

/// Until then, Abseil writes everything to stderr; from then on, errors alone.
void begin() {
  static std::once_flag once;
  std::call_once(once, absl::InitializeLog);
}

void redirect() {
  static std::once_flag once;
  std::call_once(once, [] {
    absl::SetStderrThreshold(absl::LogSeverityAtLeast::kInfinity);
    absl::AddLogSink(new Sink);
  });
}
#endif

}  // namespace

void take_grpc_log(const std::shared_ptr<const Log>& log) {
  begin();
  if (log == nullptr) return;
  {
    const std::scoped_lock lock(mutex);
    taker() = log;
  }
  redirect();
}

}  // namespace lpdeform
