#include "client/cli/interrupt.h"

#include <pthread.h>

#include <csignal>
#include <initializer_list>
#include <utility>

namespace lpdeform::cli {
namespace {

/// Tells the thread that nobody waits for signals any more.
constexpr int kEnough = SIGUSR2;

sigset_t set_of(std::initializer_list<int> numbers) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int number : numbers) sigaddset(&signals, number);
  return signals;
}

}  // namespace

Interrupt::Interrupt() {
  const sigset_t watched = set_of({SIGINT, SIGTERM, kEnough});
  pthread_sigmask(SIG_BLOCK, &watched, nullptr);
  thread_ = std::thread([this] { watch(); });
}

void Interrupt::watch() {
  const sigset_t watched = set_of({SIGINT, SIGTERM, kEnough});
  int signal = 0;
  sigwait(&watched, &signal);
  if (signal == kEnough) return;
  const sigset_t deadly = set_of({SIGINT, SIGTERM});
  pthread_sigmask(SIG_UNBLOCK, &deadly, nullptr);
  const std::scoped_lock lock(acting_);
  happened_ = true;
  if (action_) action_();
}

Interrupt::~Interrupt() {
  pthread_kill(thread_.native_handle(), kEnough);
  thread_.join();
}

void Interrupt::set_action(std::function<void()> action) {
  const std::scoped_lock lock(acting_);
  action_ = std::move(action);
  if (happened_ && action_) action_();
}

}  // namespace lpdeform::cli
