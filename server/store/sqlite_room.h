#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/sqlite_database.h"
#include "server/store/store.h"

namespace lpdeform {

/// An upper bound of what a change adds to a database.
struct ChangeSize {
  std::uint64_t bytes = 0;
  std::size_t large_values = 0;  // values with pages of their own
  bool is_removal = true;        // the change only removes
};
ChangeSize size_of(std::span<const StoredChange> changes);

/// Reserves room for a database on its disk, so that it can always remove data even if other programs fill
/// the disk to the last byte.
///
/// A commit is written to the log first, and then copied into the file. The log has its blocks
/// (SqliteDatabase::reserve_log). The file is extended before a change that adds to it, and may only have as
/// many pages as it has blocks, so copying never needs more. A change that finds no room fails completely,
/// before it is made. The last kSparePages are for removals, which may need a few pages before they free
/// many. Not thread-safe.
class SqliteRoom {
 public:
  static constexpr std::int64_t kSparePages = 32;

  /// `most_bytes`: limit for the file and the blobs together; 0: without limit.
  SqliteRoom(SqliteDatabase& database, std::string folder, std::uint64_t most_bytes);

  /// Prepares for a change of this size. Whether the change fits is known only when it is made. `blob_bytes`:
  /// total size of all blobs.
  absl::Status prepare(const ChangeSize& size, std::uint64_t blob_bytes);
  /// Prepares for a change that removes rows, or changes them in place.
  absl::Status prepare_removal();

  /// OK if a new blob of this size may be added. STORE_FULL.
  absl::Status admit_blob(std::uint64_t bytes, std::uint64_t blob_bytes);

  /// Something of this size was refused. The store counts as full until that much is free.
  void note_refused(std::uint64_t bytes) { refused_bytes_ = bytes + 1; }
  absl::StatusOr<StoreRoom> left(std::uint64_t blob_bytes);

  /// Gives free pages back to the disk, some at a time; all of them if `is_all`. A database that was created
  /// before this feature gives none back and uses its free pages again.
  absl::Status give_back(bool is_all = false);

 private:
  struct Pages {
    std::int64_t size = 0;            // bytes of one page
    std::int64_t used = 0, free = 0;  // all pages, and those of them that are free
    std::int64_t on_disk = 0;         // pages that the file has blocks for
  };
  absl::StatusOr<Pages> pages();
  absl::Status limit_to(std::int64_t pages);
  absl::Status over_limit() const;

  SqliteDatabase& database_;
  const std::string folder_;
  const std::uint64_t most_bytes_;
  std::uint64_t refused_bytes_ = 0;
};

}  // namespace lpdeform
