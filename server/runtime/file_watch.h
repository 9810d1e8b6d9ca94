#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/status/status.h"
#include "server/runtime/log.h"
#include "server/runtime/timers.h"

namespace lpdeform {

/// What is read from files that an operator may replace while the server runs.
struct WatchedFiles {
  std::string name;  // "keys": events are keys_not_read and keys_read_again
  /// Reads them again where they have changed; an error leaves what was read before in force. Nothing where they are of no more
  /// interest: then they are not looked at again.
  std::function<std::optional<absl::Status>()> refresh;
};

/// Looks at `files` every other second. What is wrong with them is logged when it begins, and that it is mended.
void watch_files(const std::shared_ptr<Timers>& timers, WatchedFiles files,
                 const std::shared_ptr<const Log>& log);

/// Of something that has refresh(), for as long as it lives.
template <typename Owner>
WatchedFiles files_of(std::string name, const std::shared_ptr<Owner>& owner) {
  return {std::move(name), [weak = std::weak_ptr(owner)]() -> std::optional<absl::Status> {
            const auto alive = weak.lock();
            return alive ? std::optional(alive->refresh()) : std::nullopt;
          }};
}

}  // namespace lpdeform
