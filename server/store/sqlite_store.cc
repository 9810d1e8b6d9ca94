#include "server/store/sqlite_store.h"

#include <algorithm>
#include <chrono>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <utility>

#include "server/runtime/refusals.h"
#include "server/store/blob_folder.h"
#include "server/store/kept_blobs.h"
#include "server/store/sealed_part.h"
#include "server/store/sqlite_database.h"
#include "server/store/sqlite_room.h"
#include "server/store/sqlite_tables.h"

namespace lpdeform {
namespace {

std::int64_t unix_ms_now() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
}

/// How many unused sessions are removed at once.
constexpr std::size_t kRemovalsAtOnce = 16;

class SqliteStore final : public Store {
 public:
  SqliteStore(std::unique_ptr<SqliteDatabase> database, BlobFolder blobs, const SqliteStoreOptions& options)
      : database_(std::move(database)),
        folder_(std::move(blobs)),
        room_(*database_, options.folder, options.most_bytes) {}

  absl::Status prepare();

  absl::StatusOr<std::vector<ChangeOutcome>> commit(std::span<const StoredChange> changes) override;
  absl::StatusOr<StoredSession> take_over(const std::string& session, const std::string& owner,
                                          const std::string& route) override;
  absl::StatusOr<std::string> find_request(const std::string& owner, const std::string& request_id) override;
  absl::StatusOr<std::vector<std::string>> list(const std::string& owner, const std::string& after,
                                                std::size_t most) override;
  absl::Status keep_blob(const std::string& session, const std::string& key, std::string_view bytes) override;
  absl::StatusOr<std::string> blob(const std::string& key) override { return folder_.read(key); }
  absl::StatusOr<TouchResult> touch(std::span<const TouchedSession> sessions) override;
  absl::Status release(const std::vector<HeldSession>&) override { return absl::OkStatus(); }
  absl::StatusOr<std::size_t> remove_unused(std::int64_t idle_ms) override;
  std::optional<StoreRoom> room() override;

 private:
  SqliteStatement& sql(Sql which) { return *statements_[static_cast<std::size_t>(which)]; }

  absl::StatusOr<ChangeOutcome> change(const StoredChange& change);
  absl::Status begin(const StoredChange& change);
  absl::StatusOr<bool> advance(const StoredChange& change);
  absl::Status write_parts(const StoredChange& change);
  absl::Status remove(const std::string& session);
  absl::StatusOr<std::map<std::string, std::string>> parts(const std::string& session);
  absl::StatusOr<bool> remove_some_parts(const std::string& session);
  absl::Status remove_all_parts(const std::string& session);
  void finish_removals();
  absl::StatusOr<std::vector<std::string>> names_of(SqliteStatement& select);
  absl::StatusOr<std::vector<ChangeOutcome>> make(std::span<const StoredChange> changes);
  void drop_unused_blobs();

  std::mutex mutex_;  // guards all members
  const std::unique_ptr<SqliteDatabase> database_;
  const BlobFolder folder_;  // thread-safe by itself
  KeptBlobs blobs_{folder_};
  SqliteRoom room_;
  const std::int64_t opened_ms_ = unix_ms_now();
  SqliteStatements statements_;
  std::set<std::string> removed_;  // sessions of which only parts are left
};

/// Prepares the statements, and removes what an earlier process left unfinished: blobs and parts of no
/// session.
absl::Status SqliteStore::prepare() {
  auto statements = prepare_statements(*database_);
  if (!statements.ok()) return statements.status();
  statements_ = *std::move(statements);
  const auto nobodys = names_of(sql(Sql::kPartsOfNobody));
  if (!nobodys.ok()) return nobodys.status();
  removed_.insert(nobodys->begin(), nobodys->end());
  if (absl::Status status = blobs_.begin(); !status.ok()) return status;
  drop_unused_blobs();
  finish_removals();
  return absl::OkStatus();
}

/// The first column of all rows.
absl::StatusOr<std::vector<std::string>> SqliteStore::names_of(SqliteStatement& select) {
  std::vector<std::string> names;
  for (;;) {
    const auto row = select.step();
    if (!row.ok()) return row.status();
    if (!*row) return names;
    names.push_back(select.text(0));
  }
}

absl::StatusOr<std::vector<ChangeOutcome>> SqliteStore::commit(std::span<const StoredChange> changes) {
  const std::scoped_lock lock(mutex_);
  auto outcomes = make(changes);
  if (is_full(outcomes.status())) room_.note_refused(size_of(changes).bytes);
  if (!outcomes.ok()) return outcomes;
  for (const StoredChange& one : changes) {
    blobs_.finish(one.session);
    if (one.is_removal) removed_.insert(one.session);
    if (!one.is_removal && one.epoch_before == 0)
      removed_.erase(one.session);  // begin() has removed all its parts
  }
  drop_unused_blobs();
  finish_removals();
  return outcomes;
}

absl::StatusOr<std::vector<ChangeOutcome>> SqliteStore::make(std::span<const StoredChange> changes) {
  const auto held = blobs_.bytes();
  if (!held.ok()) return held.status();
  if (absl::Status status = room_.prepare(size_of(changes), *held); !status.ok()) return status;
  auto transaction = SqliteTransaction::begin(*database_);
  if (!transaction.ok()) return transaction.status();
  std::vector<ChangeOutcome> outcomes;
  for (const StoredChange& one : changes) {
    const auto outcome = change(one);
    if (!outcome.ok()) return outcome.status();
    outcomes.push_back(*outcome);
  }
  if (absl::Status status = transaction->commit(); !status.ok()) return status;
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

/// A commit whose outcome was not known may have created the session already.
absl::Status SqliteStore::begin(const StoredChange& change) {
  if (absl::Status status = remove(change.session); !status.ok()) return status;
  if (absl::Status status = remove_all_parts(change.session); !status.ok()) return status;
  SqliteStatement& insert = sql(Sql::kInsertSession);
  insert.bind(1, change.session);
  insert.bind(2, change.owner);
  insert.bind(3, change.request_id);
  insert.bind(4, static_cast<std::int64_t>(change.epoch));
  insert.bind(5, unix_ms_now());
  absl::Status status = insert.run();
  for (const std::string& key : change.blobs) {
    sql(Sql::kAddBlob).bind(1, key);
    sql(Sql::kAddBlob).bind(2, change.session);
    if (status.ok()) status = sql(Sql::kAddBlob).run();
    blobs_.take(key);
  }
  return status;
}

absl::StatusOr<bool> SqliteStore::advance(const StoredChange& change) {
  SqliteStatement& update = sql(Sql::kAdvanceSession);
  update.bind(1, change.session);
  update.bind(2, static_cast<std::int64_t>(change.epoch_before));
  update.bind(3, static_cast<std::int64_t>(change.epoch));
  update.bind(4, unix_ms_now());
  if (absl::Status status = update.run(); !status.ok()) return status;
  return update.changes() == 1;
}

absl::Status SqliteStore::write_parts(const StoredChange& change) {
  absl::Status status;
  if (change.replaces_all) status = remove_all_parts(change.session);
  for (const auto& [name, value] : change.parts) {
    if (!status.ok()) break;
    SqliteStatement& write = sql(value ? Sql::kPutPart : Sql::kRemovePart);
    const std::string bytes = value ? sealed(change.session, name, *value) : "";
    write.bind(1, change.session);
    write.bind(2, name);
    if (value) write.bind_blob(3, bytes);
    status = write.run();
  }
  return status;
}

/// Removes the row that makes it a session. Its parts are removed in separate transactions, so that each fits
/// into the log, however many parts there are.
absl::Status SqliteStore::remove(const std::string& session) {
  SqliteStatement& blobs = sql(Sql::kBlobsOf);
  blobs.bind(1, session);
  const auto keys = names_of(blobs);
  if (!keys.ok()) return keys.status();
  for (const std::string& key : *keys) blobs_.release(key);
  blobs_.release_all_of(session);
  for (const Sql which : {Sql::kRemoveBlobs, Sql::kRemoveSession}) {
    sql(which).bind(1, session);
    if (absl::Status status = sql(which).run(); !status.ok()) return status;
  }
  return absl::OkStatus();
}

/// Returns whether there may be more.
absl::StatusOr<bool> SqliteStore::remove_some_parts(const std::string& session) {
  SqliteStatement& remove = sql(Sql::kRemoveSomeParts);
  remove.bind(1, session);
  remove.bind(2, std::int64_t{kPartsAtOnce});
  if (absl::Status status = remove.run(); !status.ok()) return status;
  return remove.changes() == kPartsAtOnce;
}

absl::Status SqliteStore::remove_all_parts(const std::string& session) {
  for (;;) {
    const auto has_more = remove_some_parts(session);
    if (!has_more.ok()) return has_more.status();
    if (!*has_more) return absl::OkStatus();
  }
}

/// A removal that fails is tried again with the next change, and by the next process.
void SqliteStore::finish_removals() {
  const bool has_removed = !removed_.empty();
  while (!removed_.empty()) {
    const std::string session = *removed_.begin();
    if (!room_.prepare_removal().ok()) return;
    auto transaction = SqliteTransaction::begin(*database_);
    if (!transaction.ok()) return;
    const auto has_more = remove_some_parts(session);
    if (!has_more.ok() || !transaction->commit().ok()) return;
    if (!*has_more) removed_.erase(session);
  }
  if (has_removed) room_.give_back().IgnoreError();
}

void SqliteStore::drop_unused_blobs() {
  blobs_.drop_unused([this](const std::string& key) -> std::optional<bool> {
    SqliteStatement& has = sql(Sql::kHasBlob);
    has.bind(1, key);
    const auto is_used = has.step();
    has.reset();
    return is_used.ok() ? std::optional(*is_used) : std::nullopt;
  });
}

absl::StatusOr<std::map<std::string, std::string>> SqliteStore::parts(const std::string& session) {
  std::map<std::string, std::string> parts;
  SqliteStatement& select = sql(Sql::kParts);
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

/// There is no other process, so `route` has no meaning.
absl::StatusOr<StoredSession> SqliteStore::take_over(const std::string& session, const std::string& owner,
                                                     const std::string&) {
  const std::scoped_lock lock(mutex_);
  if (absl::Status status = room_.prepare_removal(); !status.ok()) return status;
  auto transaction = SqliteTransaction::begin(*database_);
  if (!transaction.ok()) return transaction.status();
  SqliteStatement& find = sql(Sql::kFindSession);
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
  SqliteStatement& find = sql(Sql::kFindRequest);
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
  SqliteStatement& select = sql(Sql::kList);
  select.bind(1, owner);
  select.bind(2, after);
  select.bind(3, static_cast<std::int64_t>(most));
  return names_of(select);
}

absl::Status SqliteStore::keep_blob(const std::string& session, const std::string& key,
                                    std::string_view bytes) {
  absl::Status status;
  {
    const std::scoped_lock lock(mutex_);
    blobs_.pin(key, session);
    const auto held = blobs_.bytes();
    status = held.ok() ? room_.admit_blob(bytes.size(), *held) : held.status();
  }
  if (status.ok()) status = folder_.write(key, bytes);
  const std::scoped_lock lock(mutex_);
  blobs_.note_written();
  if (is_full(status)) room_.note_refused(bytes.size());
  return status;
}

std::optional<StoreRoom> SqliteStore::room() {
  const std::scoped_lock lock(mutex_);
  const auto held = blobs_.bytes();
  const auto left = held.ok() ? room_.left(*held) : held.status();
  return left.ok() ? std::optional(*left) : std::nullopt;
}

/// The folder belongs to this process alone, so no other process has taken any session.
absl::StatusOr<TouchResult> SqliteStore::touch(std::span<const TouchedSession> sessions) {
  const std::scoped_lock lock(mutex_);
  if (absl::Status status = room_.prepare_removal(); !status.ok()) return status;
  auto transaction = SqliteTransaction::begin(*database_);
  if (!transaction.ok()) return transaction.status();
  for (const TouchedSession& session : sessions) {
    sql(Sql::kTouch).bind(1, session.name);
    sql(Sql::kTouch).bind(2, unix_ms_now());
    if (absl::Status status = sql(Sql::kTouch).run(); !status.ok()) return status;
  }
  if (absl::Status status = transaction->commit(); !status.ok()) return status;
  return TouchResult();
}

absl::StatusOr<std::size_t> SqliteStore::remove_unused(std::int64_t idle_ms) {
  std::vector<StoredChange> removals;
  {
    const std::scoped_lock lock(mutex_);
    SqliteStatement& unused = sql(Sql::kUnused);
    unused.bind(1, opened_ms_);
    unused.bind(2, unix_ms_now() - idle_ms);
    const auto names = names_of(unused);
    if (!names.ok()) return names.status();
    for (const std::string& name : *names) removals.push_back({.session = name, .is_removal = true});
  }
  for (std::size_t k = 0; k < removals.size(); k += kRemovalsAtOnce) {
    const auto some = std::span(removals).subspan(k, std::min(kRemovalsAtOnce, removals.size() - k));
    if (const auto committed = commit(some); !committed.ok()) return committed.status();
  }
  return removals.size();
}

absl::StatusOr<std::shared_ptr<Store>> open(const SqliteStoreOptions& options) {
  if (absl::Status status = make_private_folder(options.folder); !status.ok()) return status;
  auto database =
      SqliteDatabase::open(options.folder + "/sessions.db");  // first, because it locks the whole folder
  if (!database.ok()) return database.status();
  if (absl::Status status = make_tables(**database); !status.ok()) return status;
  // On a full disk the log is reserved as soon as there is room.
  (*database)->reserve_log().IgnoreError();
  auto blobs = BlobFolder::open(options.folder + "/blobs");
  if (!blobs.ok()) return blobs.status();
  auto store = std::make_shared<SqliteStore>(*std::move(database), *std::move(blobs), options);
  if (absl::Status status = store->prepare(); !status.ok()) return status;
  return store;
}

}  // namespace

absl::StatusOr<std::shared_ptr<Store>> open_sqlite_store(const SqliteStoreOptions& options) {
  auto store = open(options);
  return is_full(store.status()) ? store_full_at_start(store.status(), options.folder) : store;
}

}  // namespace lpdeform
