#include "server/key_watch.h"

#include <string>

namespace lpdeform {
namespace {

constexpr std::chrono::seconds kBetweenLooks{2};

struct Watch {
  std::weak_ptr<Timers> timers;
  std::weak_ptr<Tokens> tokens;
  std::shared_ptr<const Log> log;
  bool was_bad = false;
};

void look(Watch watch);

void look_later(Watch watch) {
  const auto timers = watch.timers.lock();
  if (timers) timers->at(timers->now() + kBetweenLooks, [watch] { look(watch); });
}

void look(Watch watch) {
  const auto tokens = watch.tokens.lock();
  if (!tokens) return;
  const absl::Status status = tokens->refresh();
  if (!status.ok() && !watch.was_bad) {
    watch.log->warning("keys_not_read", {{"text", std::string(status.message())}});
  }
  if (status.ok() && watch.was_bad) watch.log->info("keys_read_again", {});
  watch.was_bad = !status.ok();
  look_later(std::move(watch));
}

}  // namespace

void watch_keys(const std::shared_ptr<Timers>& timers, const std::shared_ptr<Tokens>& tokens,
                const std::shared_ptr<const Log>& log) {
  look_later({timers, tokens, log});
}

}  // namespace lpdeform
