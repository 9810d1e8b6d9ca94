#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/store/store.h"

namespace lpdeform {

/// A store in a folder of this machine, for one server at a time and its user alone: `sessions.db`, an SQLite database in WAL mode with
/// synchronous=FULL, and `blobs/`, a file each. On a full disk it still removes: see SqliteRoom. Every part carries its CRC-32C: what the disk has changed is found when
/// it is read.
struct SqliteStoreOptions {
  std::string folder;
  /// Of the database without its log, and the blobs; its file may have 1 MiB more ready. 0: as much as the disk has.
  std::uint64_t most_bytes = 0;
};

/// Opens the store, or makes it. Errors: RESOURCE_EXHAUSTED STORE_FULL where there is no room for a new one; UNAVAILABLE STORE_FAILING where the folder cannot be written, another server has
/// it, or the database is damaged; nothing is changed then.
absl::StatusOr<std::shared_ptr<Store>> open_sqlite_store(const SqliteStoreOptions& options);

}  // namespace lpdeform
