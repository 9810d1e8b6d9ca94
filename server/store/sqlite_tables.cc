#include "server/store/sqlite_tables.h"

#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/store/store.h"

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

/// In the order of Sql.
constexpr std::array<const char*, static_cast<std::size_t>(Sql::kCount)> kSql{
    "INSERT INTO sessions VALUES (?1, ?2, ?3, ?4, ?5)",
    "UPDATE sessions SET epoch = ?3, used_ms = ?4 WHERE name = ?1 AND epoch IN (?2, ?3)",
    "SELECT owner, epoch FROM sessions WHERE name = ?1",
    "DELETE FROM sessions WHERE name = ?1",
    "INSERT INTO parts VALUES (?1, ?2, ?3) ON CONFLICT DO UPDATE SET value = excluded.value",
    "DELETE FROM parts WHERE session = ?1 AND name = ?2",
    "DELETE FROM parts WHERE rowid IN (SELECT rowid FROM parts WHERE session = ?1 LIMIT ?2)",
    "SELECT name, value FROM parts WHERE session = ?1",
    "SELECT DISTINCT session FROM parts WHERE session NOT IN (SELECT name FROM sessions)",
    "INSERT OR IGNORE INTO blobs VALUES (?1, ?2)",
    "SELECT key FROM blobs WHERE session = ?1",
    "DELETE FROM blobs WHERE session = ?1",
    "SELECT 1 FROM blobs WHERE key = ?1",
    "SELECT name FROM sessions WHERE owner = ?1 AND request_id = ?2 AND request_id <> '' ORDER BY used_ms "
    "DESC",
    "SELECT name FROM sessions WHERE owner = ?1 AND name > ?2 ORDER BY name LIMIT ?3",
    "UPDATE sessions SET used_ms = ?2 WHERE name = ?1",
    "SELECT name FROM sessions WHERE max(used_ms, ?1) < ?2"};

}  // namespace

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

absl::StatusOr<SqliteStatements> prepare_statements(const SqliteDatabase& database) {
  SqliteStatements statements;
  for (std::size_t k = 0; k < statements.size(); ++k) {
    auto prepared = SqliteStatement::prepare(database, kSql.at(k));
    if (!prepared.ok()) return prepared.status();
    statements.at(k) = std::make_unique<SqliteStatement>(*std::move(prepared));
  }
  return statements;
}

}  // namespace lpdeform
