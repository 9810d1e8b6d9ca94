#include "server/sqlite_database.h"

#include <sqlite3.h>

#include <utility>

#include "absl/strings/str_cat.h"
#include "server/store.h"

namespace lpdeform {

void SqliteDatabase::Close::operator()(sqlite3* database) const {
  sqlite3_close(database);
}

SqliteDatabase::SqliteDatabase(std::string path, sqlite3* database)
    : path_(std::move(path)), database_(database) {}

absl::Status SqliteDatabase::failure() const {
  return store_failing(absl::StrCat(sqlite3_errmsg(database_.get()), " (SQLite ",
                                    sqlite3_extended_errcode(database_.get()), ", ", path_, ")"));
}

absl::StatusOr<std::unique_ptr<SqliteDatabase>> SqliteDatabase::open(const std::string& path) {
  sqlite3* opened = nullptr;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
  const int result = sqlite3_open_v2(path.c_str(), &opened, flags, nullptr);
  std::unique_ptr<SqliteDatabase> database(new SqliteDatabase(path, opened));
  if (result != SQLITE_OK) return database->failure();
  sqlite3_extended_result_codes(opened, 1);
  // Alone in the file, so no memory is shared with other processes; every commit is on the disk when it returns.
  const absl::Status set = database->run(
      "PRAGMA locking_mode=EXCLUSIVE; PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"
      "PRAGMA trusted_schema=OFF; PRAGMA cell_size_check=ON; BEGIN EXCLUSIVE; COMMIT");
  if (!set.ok()) return set;
  return database;
}

absl::Status SqliteDatabase::run(const char* statements) {
  const int result = sqlite3_exec(database_.get(), statements, nullptr, nullptr, nullptr);
  return result == SQLITE_OK ? absl::OkStatus() : failure();
}

absl::StatusOr<std::int64_t> SqliteDatabase::number(const char* statement) {
  auto prepared = SqliteStatement::prepare(*this, statement);
  if (!prepared.ok()) return prepared.status();
  const auto row = prepared->step();
  if (!row.ok()) return row.status();
  return *row ? prepared->number(0) : 0;
}

void SqliteStatement::Finalize::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

SqliteStatement::SqliteStatement(const SqliteDatabase& database, sqlite3_stmt* statement)
    : database_(&database), statement_(statement) {}

absl::StatusOr<SqliteStatement> SqliteStatement::prepare(const SqliteDatabase& database, const char* sql) {
  sqlite3_stmt* prepared = nullptr;
  const int result =
      sqlite3_prepare_v3(database.database_.get(), sql, -1, SQLITE_PREPARE_PERSISTENT, &prepared, nullptr);
  if (result != SQLITE_OK) return database.failure();
  return SqliteStatement(database, prepared);
}

void SqliteStatement::bind(int parameter, std::string_view text) {
  sqlite3_bind_text64(statement_.get(), parameter, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8);
}

void SqliteStatement::bind_blob(int parameter, std::string_view bytes) {
  sqlite3_bind_blob64(statement_.get(), parameter, bytes.data(), bytes.size(), SQLITE_STATIC);
}

void SqliteStatement::bind(int parameter, std::int64_t number) {
  sqlite3_bind_int64(statement_.get(), parameter, number);
}

absl::StatusOr<bool> SqliteStatement::step() {
  const int result = sqlite3_step(statement_.get());
  if (result == SQLITE_ROW) return true;
  absl::Status failed;
  if (result != SQLITE_DONE) failed = database_->failure();
  sqlite3_reset(statement_.get());
  if (!failed.ok()) return failed;
  return false;
}

absl::Status SqliteStatement::run() {
  const absl::Status status = step().status();
  reset();
  return status;
}

void SqliteStatement::reset() {
  sqlite3_reset(statement_.get());
  sqlite3_clear_bindings(statement_.get());
}

std::string SqliteStatement::text(int column) const {
  const void* const bytes = sqlite3_column_blob(statement_.get(), column);
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return bytes == nullptr ? std::string() : std::string(static_cast<const char*>(bytes), size);
}

std::int64_t SqliteStatement::number(int column) const {
  return sqlite3_column_int64(statement_.get(), column);
}

int SqliteStatement::changes() const {
  return sqlite3_changes(database_->database_.get());
}

absl::StatusOr<SqliteTransaction> SqliteTransaction::begin(SqliteDatabase& database) {
  if (absl::Status status = database.run("BEGIN IMMEDIATE"); !status.ok()) return status;
  return SqliteTransaction(database);
}

SqliteTransaction::SqliteTransaction(SqliteTransaction&& other) noexcept
    : database_(std::exchange(other.database_, nullptr)) {}

SqliteTransaction::~SqliteTransaction() {
  // SQLite undoes some failures by itself; then there is nothing left to undo.
  if (database_ != nullptr) database_->run("ROLLBACK").IgnoreError();
}

absl::Status SqliteTransaction::commit() {
  absl::Status status = database_->run("COMMIT");
  if (status.ok()) database_ = nullptr;
  return status;
}

}  // namespace lpdeform
