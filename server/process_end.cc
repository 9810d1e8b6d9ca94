#include "server/process_end.h"

#include <unistd.h>

#include <future>
#include <utility>

namespace lpdeform {
namespace {

/// Logs on a thread of its own, because the reader of the log may hang, too.
[[noreturn]] void end_with(int status, const std::weak_ptr<const Log>& to,
                           std::chrono::milliseconds for_log) {
  if (const std::shared_ptr<const Log> log = to.lock()) {
    const auto written = std::make_shared<std::promise<void>>();
    std::thread([log, written] {
      log->warning("end_forced", {{"text",
                                   "A thread did not end in time, for example because a disk does not "
                                   "answer, or because the matrix of a large mesh is being factored. "
                                   "The process ends now."}});
      log->end();
      written->set_value();
    }).detach();
    written->get_future().wait_for(for_log);
  }
  _exit(status);
}

}  // namespace

ProcessEnd::~ProcessEnd() {
  {
    const std::scoped_lock lock(mutex_);
    is_ended_ = true;
  }
  changed_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void ProcessEnd::within(std::chrono::milliseconds patience, int status, std::weak_ptr<const Log> log,
                        std::chrono::milliseconds for_log) {
  const auto end = std::chrono::steady_clock::now() + patience;
  thread_ = std::thread([this, end, status, for_log, log = std::move(log)] {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_until(lock, end, [this] { return is_ended_; })) end_with(status, log, for_log);
  });
}

}  // namespace lpdeform
