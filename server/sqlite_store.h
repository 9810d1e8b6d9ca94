#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/store.h"

namespace lpdeform {

/// A store in a folder of this machine, for one server at a time: `sessions.db`, an SQLite database in WAL mode with
/// synchronous=FULL, and `blobs/`, a file each. Every part carries its CRC-32C: what the disk has changed is found when
/// it is read.
struct SqliteStoreOptions {
  std::string folder;
  /// Of the database without its log, and the blobs; 0: as much as the disk has.
  std::uint64_t most_bytes = 0;
};

/// Opens the store, or makes it. Errors: UNAVAILABLE STORE_FAILING where the folder cannot be written, another server has
/// it, or the database is damaged; nothing is changed then.
absl::StatusOr<std::shared_ptr<Store>> open_sqlite_store(const SqliteStoreOptions& options);

}  // namespace lpdeform
