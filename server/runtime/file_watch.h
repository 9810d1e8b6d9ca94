#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "server/runtime/log.h"
#include "server/runtime/timers.h"

namespace lpdeform {

/// Files that an operator may replace while the server runs.
struct WatchedFiles {
  std::string name;  // "keys": events are keys_not_read and keys_read_again
  /// Reads the files again if they have changed. After an error, what was read before stays in force. Returns
  /// nullopt when the files are no longer needed: then they are not checked again.
  std::function<std::optional<absl::Status>()> refresh;
};

/// Checks `files` every two seconds. Logs once when a problem begins and once when it is over.
void watch_files(const std::shared_ptr<Timers>& timers, WatchedFiles files,
                 const std::shared_ptr<const Log>& log);

/// Watches the files of an object that has refresh(), for as long as the object lives.
template <typename Owner>
WatchedFiles files_of(std::string name, const std::shared_ptr<Owner>& owner) {
  return {std::move(name), [weak = std::weak_ptr(owner)]() -> std::optional<absl::Status> {
            const auto alive = weak.lock();
            return alive ? std::optional(alive->refresh()) : std::nullopt;
          }};
}

}  // namespace lpdeform
