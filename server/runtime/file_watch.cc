#include "server/runtime/file_watch.h"

#include <utility>

#include "absl/strings/str_cat.h"

namespace lpdeform {
namespace {

constexpr std::chrono::seconds kBetweenLooks{2};

struct Watch {
  std::weak_ptr<Timers> timers;
  WatchedFiles files;
  std::shared_ptr<const Log> log;
  bool was_bad = false;
};

void look(Watch watch);

void look_later(Watch watch) {
  const auto timers = watch.timers.lock();
  if (timers) timers->at(timers->now() + kBetweenLooks, [watch] { look(watch); });
}

void look(Watch watch) {
  const std::optional<absl::Status> status = watch.files.refresh();
  if (!status) return;
  if (!status->ok() && !watch.was_bad) {
    watch.log->warning(absl::StrCat(watch.files.name, "_not_read"),
                       {{"text", std::string(status->message())}});
  }
  if (status->ok() && watch.was_bad) watch.log->info(absl::StrCat(watch.files.name, "_read_again"), {});
  watch.was_bad = !status->ok();
  look_later(std::move(watch));
}

}  // namespace

void watch_files(const std::shared_ptr<Timers>& timers, WatchedFiles files,
                 const std::shared_ptr<const Log>& log) {
  look_later({timers, std::move(files), log});
}

}  // namespace lpdeform
