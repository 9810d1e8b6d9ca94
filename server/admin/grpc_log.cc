#include "server/admin/grpc_log.h"

#include <grpc/support/log.h>

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

void pass_on(gpr_log_func_args* args) {
  std::shared_ptr<const Log> log;
  {
    const std::scoped_lock lock(mutex);
    log = taker().lock();
  }
  if (log == nullptr) return;
  const std::string_view path = args->file;
  const std::size_t slash = path.rfind('/');
  const std::string file(path.substr(slash == std::string_view::npos ? 0 : slash + 1));
  const auto line = static_cast<std::uint64_t>(args->line);
  if (args->severity == GPR_LOG_SEVERITY_ERROR) return log->warning("grpc", {{"file", file}, {"line", line}});
  log->debug("grpc", {{"file", file}, {"line", line}});
}

}  // namespace

void take_grpc_log(const std::shared_ptr<const Log>& log) {
  const std::scoped_lock lock(mutex);
  taker() = log;
  gpr_set_log_function(pass_on);
}

}  // namespace lpdeform
