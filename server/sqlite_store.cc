#include "server/sqlite_store.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <map>
#include <mutex>
#include <set>
#include <system_error>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/crc32c.h"
#include "server/blob_folder.h"
#include "server/sqlite_database.h"

namespace lpdeform {
namespace {

constexpr std::int64_t kVersion = 1;

constexpr const char* kTables =
    "CREATE TABLE sessions (name TEXT PRIMARY KEY, owner TEXT NOT NULL, request_id TEXT NOT NULL,"
    "                       epoch INTEGER NOT NULL, used_ms INTEGER NOT NULL) WITHOUT ROWID;"
    "CREATE INDEX requests ON sessions (owner, request_id) WHERE request_id <> '';"
    "CREATE TABLE parts (session TEXT NOT NULL, name TEXT NOT NULL, value BLOB NOT NULL,"
    "                    PRIMARY KEY (session, name));"
    "CREATE TABLE blobs (key TEXT NOT NULL, session TEXT NOT NULL, PRIMARY KEY (key, session)) WITHOUT ROWID;"
    "CREATE INDEX blobs_of ON blobs (session);"
    "PRAGMA user_version = 1;";

std::int64_t unix_ms_now() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
}

/// Over the value and where it belongs, so that one cannot stand in for another.
std::uint32_t checksum(std::string_view session, std::string_view part, std::string_view value) {
  return crc32c(value, crc32c(part, crc32c(session)));
}

std::string sealed(const std::string& session, const std::string& part, const std::string& value) {
  const std::uint32_t sum = checksum(session, part, value);
  std::string bytes;
  bytes.reserve(value.size() + 4);
  for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<char>(sum >> shift));
  return bytes.append(value);
}

absl::StatusOr<std::string> unsealed(const std::string& session, const std::string& part, std::string bytes) {
  std::uint32_t sum = 0;
  for (std::size_t k = 0; k < 4 && k < bytes.size(); ++k)
    sum |= std::uint32_t{static_cast<unsigned char>(bytes[k])} << (8 * k);
  if (bytes.size() >= 4) {
    bytes.erase(0, 4);
    if (checksum(session, part, bytes) == sum) return bytes;
  }
  return session_damaged("a part of it has the wrong checksum", part);
}

class SqliteStore final : public Store {
 public:
  SqliteStore(std::unique_ptr<SqliteDatabase> database, BlobFolder blobs, std::uint64_t most_bytes)
      : database_(std::move(database)), blobs_(std::move(blobs)), most_bytes_(most_bytes) {}

  absl::Status prepare();

  absl::StatusOr<std::vector<ChangeOutcome>> commit(std::span<const StoredChange> changes) override;
  absl::StatusOr<StoredSession> take_over(const std::string& session, const std::string& owner,
                                          const std::string& route) override;
  absl::StatusOr<std::string> find_request(const std::string& owner, const std::string& request_id) override;
  absl::StatusOr<std::vector<std::string>> list(const std::string& owner, const std::string& after,
                                                std::size_t most) override;
  absl::Status keep_blob(const std::string& session, const std::string& key, std::string_view bytes) override;
  absl::StatusOr<std::string> blob(const std::string& key) override { return blobs_.read(key); }
  absl::StatusOr<TouchResult> touch(std::span<const TouchedSession> sessions) override;
  absl::Status let_go(const std::vector<HeldSession>&) override { return absl::OkStatus(); }
  absl::StatusOr<std::size_t> remove_unused(std::int64_t idle_ms) override;

 private:
  enum Sql {
    kInsertSession,
    kAdvanceSession,
    kFindSession,
    kRemoveSession,
    kPutPart,
    kRemovePart,
    kRemoveParts,
    kParts,
    kAddBlob,
    kBlobsOf,
    kRemoveBlobs,
    kHasBlob,
    kFindRequest,
    kList,
    kTouch,
    kUnused,
    kCount
  };
  SqliteStatement& sql(Sql which) { return *statements_[which]; }

  absl::StatusOr<ChangeOutcome> change(const StoredChange& change);
  absl::Status begin(const StoredChange& change);
  absl::StatusOr<bool> advance(const StoredChange& change);
  absl::Status write_parts(const StoredChange& change);
  absl::Status remove(const std::string& session);
  absl::StatusOr<std::map<std::string, std::string>> parts(const std::string& session);
  absl::Status limit_size();
  void drop_unused_blobs();

  std::mutex mutex_;  // guards all
  const std::unique_ptr<SqliteDatabase> database_;
  const BlobFolder blobs_;
  const std::uint64_t most_bytes_;
  const std::int64_t opened_ms_ = unix_ms_now();
  std::array<std::unique_ptr<SqliteStatement>, kCount> statements_;
  std::map<std::string, std::set<std::string>> pinned_;  // sessions that are being made, by the blobs' keys
  std::set<std::string> loose_;                          // blobs that a session has let go of
};

/// Statements, and what an earlier process left half done: blobs that no session has.
absl::Status SqliteStore::prepare() {
  static constexpr std::array<const char*, kCount> kSql{
      "INSERT INTO sessions VALUES (?1, ?2, ?3, ?4, ?5)",
      "UPDATE sessions SET epoch = ?3, used_ms = ?4 WHERE name = ?1 AND epoch IN (?2, ?3)",
      "SELECT owner, epoch FROM sessions WHERE name = ?1",
      "DELETE FROM sessions WHERE name = ?1",
      "INSERT INTO parts VALUES (?1, ?2, ?3) ON CONFLICT DO UPDATE SET value = excluded.value",
      "DELETE FROM parts WHERE session = ?1 AND name = ?2",
      "DELETE FROM parts WHERE session = ?1",
      "SELECT name, value FROM parts WHERE session = ?1",
      "INSERT OR IGNORE INTO blobs VALUES (?1, ?2)",
      "SELECT key FROM blobs WHERE session = ?1",
      "DELETE FROM blobs WHERE session = ?1",
      "SELECT 1 FROM blobs WHERE key = ?1",
      "SELECT name FROM sessions WHERE owner = ?1 AND request_id = ?2 AND request_id <> '' ORDER BY used_ms "
      "DESC",
      "SELECT name FROM sessions WHERE owner = ?1 AND name > ?2 ORDER BY name LIMIT ?3",
      "UPDATE sessions SET used_ms = ?2 WHERE name = ?1",
      "SELECT name FROM sessions WHERE max(used_ms, ?1) < ?2"};
  for (std::size_t k = 0; k < kCount; ++k) {
    auto prepared = SqliteStatement::prepare(*database_, kSql[k]);
    if (!prepared.ok()) return prepared.status();
    statements_[k] = std::make_unique<SqliteStatement>(*std::move(prepared));
  }
  auto keys = blobs_.keys();
  if (!keys.ok()) return keys.status();
  loose_ = *std::move(keys);
  drop_unused_blobs();
  return limit_size();
}

absl::StatusOr<std::vector<ChangeOutcome>> SqliteStore::commit(std::span<const StoredChange> changes) {
  const std::scoped_lock lock(mutex_);
  auto transaction = SqliteTransaction::begin(*database_);
  if (!transaction.ok()) return transaction.status();
  std::vector<ChangeOutcome> outcomes;
  for (const StoredChange& one : changes) {
    const auto outcome = change(one);
    if (!outcome.ok()) return outcome.status();
    outcomes.push_back(*outcome);
  }
  if (absl::Status status = transaction->commit(); !status.ok()) return status;
  for (const StoredChange& one : changes) {
    for (auto& [key, sessions] : pinned_) sessions.erase(one.session);
  }
  std::erase_if(pinned_, [](const auto& pin) { return pin.second.empty(); });
  drop_unused_blobs();
  return outcomes;
}

absl::StatusOr<ChangeOutcome> SqliteStore::change(const StoredChange& change) {
  if (change.is_removal) {
    if (absl::Status status = remove(change.session); !status.ok()) return status;
    return ChangeOutcome::kKept;
  }
  if (change.epoch_before == 0) {
    if (absl::Status status = begin(change); !status.ok()) return status;
  } else {
    const auto is_ours = advance(change);
    if (!is_ours.ok()) return is_ours.status();
    if (!*is_ours) return ChangeOutcome::kFenced;
  }
  if (absl::Status status = write_parts(change); !status.ok()) return status;
  return ChangeOutcome::kKept;
}

/// A commit whose outcome was not known may have made it already.
absl::Status SqliteStore::begin(const StoredChange& change) {
  if (absl::Status status = remove(change.session); !status.ok()) return status;
  SqliteStatement& insert = sql(kInsertSession);
  insert.bind(1, change.session);
  insert.bind(2, change.owner);
  insert.bind(3, change.request_id);
  insert.bind(4, static_cast<std::int64_t>(change.epoch));
  insert.bind(5, unix_ms_now());
  absl::Status status = insert.run();
  for (const std::string& key : change.blobs) {
    sql(kAddBlob).bind(1, key);
    sql(kAddBlob).bind(2, change.session);
    if (status.ok()) status = sql(kAddBlob).run();
    loose_.erase(key);
  }
  return status;
}

absl::StatusOr<bool> SqliteStore::advance(const StoredChange& change) {
  SqliteStatement& update = sql(kAdvanceSession);
  update.bind(1, change.session);
  update.bind(2, static_cast<std::int64_t>(change.epoch_before));
  update.bind(3, static_cast<std::int64_t>(change.epoch));
  update.bind(4, unix_ms_now());
  if (absl::Status status = update.run(); !status.ok()) return status;
  return update.changes() == 1;
}

absl::Status SqliteStore::write_parts(const StoredChange& change) {
  absl::Status status;
  if (change.replaces_all) {
    sql(kRemoveParts).bind(1, change.session);
    status = sql(kRemoveParts).run();
  }
  for (const auto& [name, value] : change.parts) {
    if (!status.ok()) break;
    SqliteStatement& write = sql(value ? kPutPart : kRemovePart);
    const std::string bytes = value ? sealed(change.session, name, *value) : "";
    write.bind(1, change.session);
    write.bind(2, name);
    if (value) write.bind_blob(3, bytes);
    status = write.run();
  }
  return status;
}

absl::Status SqliteStore::remove(const std::string& session) {
  SqliteStatement& blobs = sql(kBlobsOf);
  blobs.bind(1, session);
  for (;;) {
    const auto row = blobs.step();
    if (!row.ok()) return row.status();
    if (!*row) break;
    loose_.insert(blobs.text(0));
  }
  for (const auto& [key, sessions] : pinned_) {
    if (sessions.contains(session)) loose_.insert(key);
  }
  for (const Sql which : {kRemoveBlobs, kRemoveParts, kRemoveSession}) {
    sql(which).bind(1, session);
    if (absl::Status status = sql(which).run(); !status.ok()) return status;
  }
  return absl::OkStatus();
}

/// Those of loose_ that no session has any more. What fails is tried again with the next change.
void SqliteStore::drop_unused_blobs() {
  bool has_dropped = false;
  for (auto key = loose_.begin(); key != loose_.end();) {
    SqliteStatement& has = sql(kHasBlob);
    has.bind(1, *key);
    const auto is_used = has.step();
    has.reset();
    if (!is_used.ok() || pinned_.contains(*key)) {
      ++key;
      continue;
    }
    if (!*is_used) blobs_.remove(*key);
    has_dropped = has_dropped || !*is_used;
    key = loose_.erase(key);
  }
  if (has_dropped) limit_size().IgnoreError();
}

absl::StatusOr<std::map<std::string, std::string>> SqliteStore::parts(const std::string& session) {
  std::map<std::string, std::string> parts;
  SqliteStatement& select = sql(kParts);
  select.bind(1, session);
  for (;;) {
    const auto row = select.step();
    if (!row.ok()) return row.status();
    if (!*row) return parts;
    const std::string name = select.text(0);
    auto value = unsealed(session, name, select.text(1));
    if (!value.ok()) {
      select.reset();
      return value.status();
    }
    parts[name] = *std::move(value);
  }
}

/// There is no other process, and so no route.
absl::StatusOr<StoredSession> SqliteStore::take_over(const std::string& session, const std::string& owner,
                                                     const std::string&) {
  const std::scoped_lock lock(mutex_);
  auto transaction = SqliteTransaction::begin(*database_);
  if (!transaction.ok()) return transaction.status();
  SqliteStatement& find = sql(kFindSession);
  find.bind(1, session);
  const auto row = find.step();
  if (!row.ok()) return row.status();
  StoredSession found;
  std::uint64_t epoch_before = 0;
  if (*row) {
    found.owner = find.text(0);
    epoch_before = static_cast<std::uint64_t>(find.number(1));
    found.epoch = epoch_before + kEpochsOfALife;
    find.reset();
  }
  if (!*row || found.owner != owner) return session_unknown();
  auto parts = this->parts(session);
  if (!parts.ok()) return parts.status();
  found.parts = *std::move(parts);
  StoredChange next{.session = session, .epoch_before = epoch_before, .epoch = found.epoch};
  if (const auto is_ours = advance(next); !is_ours.ok()) return is_ours.status();
  if (absl::Status status = transaction->commit(); !status.ok()) return status;
  return found;
}

absl::StatusOr<std::string> SqliteStore::find_request(const std::string& owner,
                                                      const std::string& request_id) {
  const std::scoped_lock lock(mutex_);
  SqliteStatement& find = sql(kFindRequest);
  find.bind(1, owner);
  find.bind(2, request_id);
  const auto row = find.step();
  if (!row.ok()) return row.status();
  std::string name = *row ? find.text(0) : "";
  find.reset();
  return name;
}

absl::StatusOr<std::vector<std::string>> SqliteStore::list(const std::string& owner, const std::string& after,
                                                           std::size_t most) {
  const std::scoped_lock lock(mutex_);
  SqliteStatement& select = sql(kList);
  select.bind(1, owner);
  select.bind(2, after);
  select.bind(3, static_cast<std::int64_t>(most));
  std::vector<std::string> names;
  for (;;) {
    const auto row = select.step();
    if (!row.ok()) return row.status();
    if (!*row) return names;
    names.push_back(select.text(0));
  }
}

absl::Status SqliteStore::keep_blob(const std::string& session, const std::string& key,
                                    std::string_view bytes) {
  {
    const std::scoped_lock lock(mutex_);
    pinned_[key].insert(session);
    if (most_bytes_ != 0) {
      const auto held = blobs_.bytes();
      const auto pages =
          database_->number("SELECT page_count * page_size FROM pragma_page_count, pragma_page_size");
      if (!held.ok()) return held.status();
      if (!pages.ok()) return pages.status();
      if (*held + static_cast<std::uint64_t>(*pages) + bytes.size() > most_bytes_) {
        return store_failing(absl::StrCat("it may have ", most_bytes_, " bytes, and is full"));
      }
    }
  }
  absl::Status status = blobs_.write(key, bytes);
  const std::scoped_lock lock(mutex_);
  if (status.ok()) status = limit_size();
  return status;
}

/// What blobs leave is for the database.
absl::Status SqliteStore::limit_size() {
  if (most_bytes_ == 0) return absl::OkStatus();
  const auto held = blobs_.bytes();
  if (!held.ok()) return held.status();
  const auto page_size = database_->number("PRAGMA page_size");
  if (!page_size.ok()) return page_size.status();
  const std::uint64_t left = most_bytes_ - std::min(most_bytes_, *held);
  const auto pages = std::max<std::uint64_t>(1, left / static_cast<std::uint64_t>(*page_size));
  return database_->run(absl::StrCat("PRAGMA max_page_count = ", pages).c_str());
}

/// The folder is this process's own, so nobody else has taken any of them.
absl::StatusOr<TouchResult> SqliteStore::touch(std::span<const TouchedSession> sessions) {
  const std::scoped_lock lock(mutex_);
  auto transaction = SqliteTransaction::begin(*database_);
  if (!transaction.ok()) return transaction.status();
  for (const TouchedSession& session : sessions) {
    sql(kTouch).bind(1, session.name);
    sql(kTouch).bind(2, unix_ms_now());
    if (absl::Status status = sql(kTouch).run(); !status.ok()) return status;
  }
  if (absl::Status status = transaction->commit(); !status.ok()) return status;
  return TouchResult();
}

absl::StatusOr<std::size_t> SqliteStore::remove_unused(std::int64_t idle_ms) {
  std::vector<StoredChange> removals;
  {
    const std::scoped_lock lock(mutex_);
    SqliteStatement& unused = sql(kUnused);
    unused.bind(1, opened_ms_);
    unused.bind(2, unix_ms_now() - idle_ms);
    for (;;) {
      const auto row = unused.step();
      if (!row.ok()) return row.status();
      if (!*row) break;
      removals.push_back({.session = unused.text(0), .is_removal = true});
    }
  }
  if (removals.empty()) return 0;
  const auto committed = commit(removals);
  if (!committed.ok()) return committed.status();
  return removals.size();
}

/// Makes the tables of a new database; looks through one that was there.
absl::Status make_tables(SqliteDatabase& database) {
  const auto version = database.number("PRAGMA user_version");
  if (!version.ok()) return version.status();
  if (*version == 0) {
    auto transaction = SqliteTransaction::begin(database);
    if (!transaction.ok()) return transaction.status();
    if (absl::Status status = database.run(kTables); !status.ok()) return status;
    return transaction->commit();
  }
  if (*version != kVersion) {
    return store_failing(
        absl::StrCat(database.path(), " is of version ", *version, ", and this server's is ", kVersion));
  }
  const auto faults = database.number("SELECT count(*) FROM pragma_quick_check WHERE quick_check <> 'ok'");
  if (!faults.ok()) return faults.status();
  if (*faults == 0) return absl::OkStatus();
  return store_failing(absl::StrCat(database.path(), " is damaged; put it aside or bring back a copy"));
}

}  // namespace

absl::StatusOr<std::shared_ptr<Store>> open_sqlite_store(const SqliteStoreOptions& options) {
  std::error_code error;
  std::filesystem::create_directories(options.folder, error);
  if (error) return store_failing(absl::StrCat(error.message(), " (", options.folder, ")"));
  auto database =
      SqliteDatabase::open(options.folder + "/sessions.db");  // first: it is the lock of the whole folder
  if (!database.ok()) return database.status();
  if (absl::Status status = make_tables(**database); !status.ok()) return status;
  auto blobs = BlobFolder::open(options.folder + "/blobs");
  if (!blobs.ok()) return blobs.status();
  auto store = std::make_shared<SqliteStore>(*std::move(database), *std::move(blobs), options.most_bytes);
  if (absl::Status status = store->prepare(); !status.ok()) return status;
  return store;
}

}  // namespace lpdeform
