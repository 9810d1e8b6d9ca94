#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/store/sqlite_database.h"
#include "server/store/store.h"

namespace lpdeform {

/// What changes add to a database, at most.
struct ChangeSize {
  std::uint64_t bytes = 0;
  std::size_t large_values = 0;  // which have pages of their own
  bool is_removal = true;        // nothing else
};
ChangeSize size_of(std::span<const StoredChange> changes);

/// What a database may take of its disk, so that it can always remove: other programs may fill the disk to the last byte.
///
/// A commit goes into the log first, and is then copied into the file. The log has its blocks (SqliteDatabase::reserve_log). The file
/// is made longer before a change that adds to it, and may have as many pages as it has blocks, so copying never needs more: a change
/// that finds no room fails as a whole, before it is made. The last kSparePages are for removals, which may need a few before they
/// give many back. Not thread-safe.
class SqliteRoom {
 public:
  static constexpr std::int64_t kSparePages = 32;

  /// `most_bytes`: of the file and the blobs together; 0: without limit.
  SqliteRoom(SqliteDatabase& database, std::string folder, std::uint64_t most_bytes);

  /// Before a change of this size. Whether it fits shows as it is made. `blob_bytes`: of all blobs.
  absl::Status prepare(const ChangeSize& size, std::uint64_t blob_bytes);
  /// Before a change that removes, or changes rows where they are.
  absl::Status prepare_removal();

  /// OK where a new blob of so many bytes may come. STORE_FULL.
  absl::Status admit_blob(std::uint64_t bytes, std::uint64_t blob_bytes);

  /// Something of this size was refused: full until there is as much.
  void note_refused(std::uint64_t bytes) { refused_bytes_ = bytes + 1; }
  absl::StatusOr<StoreRoom> left(std::uint64_t blob_bytes);

  /// Gives free pages back to the disk, some at a time; all of them where `is_all`. Of a database that was made before this could be,
  /// none: it uses them again.
  absl::Status give_back(bool is_all = false);

 private:
  struct Pages {
    std::int64_t size = 0;            // bytes of one
    std::int64_t used = 0, free = 0;  // of all, those that are free
    std::int64_t on_disk = 0;         // that the file has blocks for
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
