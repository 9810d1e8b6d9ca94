#include "client/cli/interrupt.h"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdint>
#include <utility>

#include "core/base/check.h"

namespace lpdeform::cli {
namespace {

// The value written to the event tells who wrote it.
constexpr std::uint64_t kSignal = 1;
constexpr std::uint64_t kEnough = std::uint64_t{1} << 32;

/// The event of the one Interrupt that exists. It uses a handler and no blocked mask: libraries start threads
/// before main, and a signal goes to any thread that does not block it.
std::atomic<int> event = -1;

void post(std::uint64_t what) {
  const int error = errno;
  [[maybe_unused]] const ssize_t written = write(event, &what, sizeof what);
  errno = error;
}

void set_handlers(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART | static_cast<int>(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

}  // namespace

Interrupt::Interrupt() {
  event = eventfd(0, EFD_CLOEXEC);
  LPDEFORM_CHECK(event >= 0);
  thread_ = std::thread([this] { watch(); });
  set_handlers([](int) { post(kSignal); });
}

void Interrupt::watch() {
  std::uint64_t what = 0;
  while (read(event, &what, sizeof what) < 0 && errno == EINTR) {
  }
  if (what >= kEnough) return;
  const std::scoped_lock lock(acting_);
  happened_ = true;
  if (action_) action_();
}

Interrupt::~Interrupt() {
  set_handlers(SIG_DFL);
  post(kEnough);
  thread_.join();
  close(event.exchange(-1));
}

void Interrupt::set_action(std::function<void()> action) {
  const std::scoped_lock lock(acting_);
  action_ = std::move(action);
  if (happened_ && action_) action_();
}

}  // namespace lpdeform::cli
