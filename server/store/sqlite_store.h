#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "absl/status/statusor.h"
#include "server/store/store.h"

namespace lpdeform {

/// A store in a folder of this machine, for one server at a time and readable by its user alone. It has
/// `sessions.db`, an SQLite database in WAL mode with synchronous=FULL, and `blobs/`, with one file per blob.
/// On a full disk it still removes: see SqliteRoom. Every part carries its CRC-32C, so damage on the disk is
/// found when the part is read.
struct SqliteStoreOptions {
  std::string folder;
  /// Limit for the database without its log, and the blobs; the file may have 1 MiB more in reserve. 0: as
  /// much as the disk has.
  std::uint64_t most_bytes = 0;
};

/// Opens the store, or creates it. Errors: RESOURCE_EXHAUSTED STORE_FULL if there is no room for a new one;
/// UNAVAILABLE STORE_FAILING if the folder cannot be written, another server has it open, or the database is
/// damaged. After an error nothing has changed.
absl::StatusOr<std::shared_ptr<Store>> open_sqlite_store(const SqliteStoreOptions& options);

}  // namespace lpdeform
