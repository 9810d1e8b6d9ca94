#include "server/store/sqlite_room.h"

#include <sys/stat.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"

namespace lpdeform {
namespace {

/// Free pages that are kept for later changes, and how many pages are given back at a time; each one moves
/// another page into its place.
constexpr std::int64_t kKeptPages = 512, kGivenPages = 256;
/// Pages that a change may need besides its rows: inner nodes of trees, which may split.
constexpr std::int64_t kInnerPages = 16;

/// Bytes of a row besides its value, and the size from which on a value has pages of its own.
constexpr std::size_t kRowBytes = 64, kLargeValue = 2000;

}  // namespace

ChangeSize size_of(std::span<const StoredChange> changes) {
  ChangeSize size;
  for (const StoredChange& change : changes) {
    size.is_removal = size.is_removal && change.is_removal;
    for (const auto& [name, value] : change.parts) {
      size.bytes += (value ? value->size() : 0) + 2 * (change.session.size() + name.size()) + kRowBytes;
      size.large_values += value && value->size() > kLargeValue ? 1 : 0;
    }
  }
  return size;
}

SqliteRoom::SqliteRoom(SqliteDatabase& database, std::string folder, std::uint64_t most_bytes)
    : database_(database), folder_(std::move(folder)), most_bytes_(most_bytes) {}

absl::StatusOr<SqliteRoom::Pages> SqliteRoom::pages() {
  if (!database_.is_in_place())
    return store_failing("its folder was removed or moved while the server runs", database_.path());
  Pages pages;
  for (const auto& [pragma, value] :
       {std::pair("PRAGMA page_size", &pages.size), std::pair("PRAGMA page_count", &pages.used),
        std::pair("PRAGMA freelist_count", &pages.free)}) {
    const auto number = database_.number(pragma);
    if (!number.ok()) return number.status();
    *value = *number;
  }
  struct stat about = {};
  if (stat(database_.path().c_str(), &about) == 0) pages.on_disk = about.st_size / pages.size;
  return pages;
}

/// SQLite never removes pages that are in use.
absl::Status SqliteRoom::limit_to(std::int64_t pages) {
  return database_.run(absl::StrCat("PRAGMA max_page_count = ", std::max<std::int64_t>(1, pages)).c_str());
}

absl::Status SqliteRoom::prepare(const ChangeSize& size, std::uint64_t blob_bytes) {
  if (size.is_removal) return prepare_removal();
  // If the log has no room either, the change itself will fail.
  static_cast<void>(database_.reserve_log());
  auto before = pages();
  if (!before.ok()) return before.status();
  const auto need = static_cast<std::int64_t>(size.bytes) / before->size * 9 / 8 +
                    static_cast<std::int64_t>(size.large_values) + kInnerPages + kSparePages;
  std::int64_t most = std::numeric_limits<std::int32_t>::max();
  if (most_bytes_ != 0) {
    most = static_cast<std::int64_t>(most_bytes_ - std::min(most_bytes_, blob_bytes)) / before->size;
    const std::int64_t left = before->free + std::max<std::int64_t>(0, most - before->used);
    if (static_cast<std::int64_t>(size.bytes) / before->size > left) return over_limit();
  }
  if (const std::int64_t missing = need - before->free; missing > before->on_disk - before->used) {
    // The change may succeed without the pages that the file cannot get.
    const std::int64_t wanted =
        std::min(before->used + missing, std::max(most + kSparePages, before->used + kSparePages));
    if (!database_.grow_to(wanted * before->size).ok())
      database_.grow_to(before->on_disk * before->size + 1)
          .IgnoreError();  // the smallest step by which it can grow
    before = pages();
    if (!before.ok()) return before.status();
  }
  return limit_to(std::min(most, before->on_disk - kSparePages));
}

absl::Status SqliteRoom::prepare_removal() {
  static_cast<void>(database_.reserve_log());
  const auto now = pages();
  if (!now.ok()) return now.status();
  if (now->on_disk - now->used + now->free < kSparePages)
    database_.grow_to((now->used + kSparePages) * now->size).IgnoreError();
  const auto after = pages();
  if (!after.ok()) return after.status();
  return limit_to(after->on_disk);
}

absl::Status SqliteRoom::admit_blob(std::uint64_t bytes, std::uint64_t blob_bytes) {
  if (most_bytes_ == 0) return absl::OkStatus();
  for (const bool is_last : {false, true}) {
    const auto now = pages();
    if (!now.ok()) return now.status();
    if (blob_bytes + static_cast<std::uint64_t>(now->used * now->size) + bytes <= most_bytes_)
      return absl::OkStatus();
    if (is_last || now->free == 0) break;
    if (absl::Status status = give_back(true); !status.ok()) return status;
  }
  return over_limit();
}

absl::Status SqliteRoom::over_limit() const {
  return store_full(absl::StrCat("it may have ", most_bytes_, " bytes"),
                    absl::StrCat("bytes <= ", most_bytes_));
}

absl::StatusOr<StoreRoom> SqliteRoom::left(std::uint64_t blob_bytes) {
  const auto now = pages();
  if (!now.ok()) return now.status();
  struct statvfs disk = {};
  if (statvfs(folder_.c_str(), &disk) != 0) return store_failing("no answer from its disk", folder_);
  const auto unit = static_cast<double>(disk.f_frsize);
  StoreRoom room{static_cast<double>(disk.f_bavail) * unit, static_cast<double>(disk.f_blocks) * unit};
  if (most_bytes_ != 0) {
    const auto most = static_cast<double>(most_bytes_);
    const auto held =
        static_cast<double>(blob_bytes) + static_cast<double>((now->used - now->free) * now->size);
    room.free_bytes = std::min(room.free_bytes, std::max(0.0, most - held));
    room.limit_bytes = std::min(room.limit_bytes, most);
  }
  if (room.free_bytes >= static_cast<double>(refused_bytes_)) refused_bytes_ = 0;
  room.is_full = refused_bytes_ != 0;
  return room;
}

absl::Status SqliteRoom::give_back(bool is_all) {
  for (;;) {
    const auto now = pages();
    if (!now.ok()) return now.status();
    if (now->free <= (is_all ? 0 : kKeptPages)) return absl::OkStatus();
    if (absl::Status status =
            database_.run(absl::StrCat("PRAGMA incremental_vacuum(", kGivenPages, ")").c_str());
        !status.ok())
      return status;
    const auto after = database_.number("PRAGMA freelist_count");
    if (!after.ok()) return after.status();
    if (*after >= now->free || !is_all) return absl::OkStatus();
  }
}

}  // namespace lpdeform
