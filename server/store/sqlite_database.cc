#include "server/store/sqlite_database.h"

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "server/store/store.h"

namespace lpdeform {
namespace {

/// Size of the log's header. Without a valid header SQLite ignores the rest of the log.
constexpr std::size_t kLogHeaderBytes = 32;

/// Makes an empty file that only its user may read; SQLite gives its own files the same mode. An existing
/// file gets this mode, too. This function never closes an existing file: that would release the locks that
/// this process has on it.
void keep_private(const std::string& path) {
  const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (fd >= 0) close(fd);
  for (const char* const suffix : {"", "-wal", "-shm"}) {
    // If the disk knows no modes, or the file belongs to another user, the mode stays as it is.
    static_cast<void>(chmod(absl::StrCat(path, suffix).c_str(), S_IRUSR | S_IWUSR));
  }
}

bool is_out_of_room(sqlite3* database) {
  const int code = sqlite3_errcode(database) & 0xff;
  if (code == SQLITE_FULL) return true;
  const int error = sqlite3_system_errno(database);
  return (code == SQLITE_IOERR || code == SQLITE_CANTOPEN) && (error == ENOSPC || error == EDQUOT);
}

absl::Status failed(const std::string& path, int error) {
  const std::string why = std::system_category().message(error);
  return error == ENOSPC || error == EDQUOT ? store_full(why, "", path) : store_failing(why, path);
}

}  // namespace

void SqliteDatabase::Close::operator()(sqlite3* database) const {
  sqlite3_close(database);
}

SqliteDatabase::SqliteDatabase(std::string path, sqlite3* database)
    : path_(std::move(path)), database_(database) {}

SqliteDatabase::~SqliteDatabase() {
  if (has_log_) static_cast<void>(empty_log());
}

absl::Status SqliteDatabase::failure() const {
  const std::string why = absl::StrCat(sqlite3_errmsg(database_.get()), " (SQLite ",
                                       sqlite3_extended_errcode(database_.get()), ")");
  return is_out_of_room(database_.get()) ? store_full(why, "", path_) : store_failing(why, path_);
}

absl::StatusOr<std::unique_ptr<SqliteDatabase>> SqliteDatabase::open(const std::string& path) {
  keep_private(path);
  sqlite3* opened = nullptr;
  const int flags = SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX;
  const int result = sqlite3_open_v2(path.c_str(), &opened, flags, nullptr);
  std::unique_ptr<SqliteDatabase> database(new SqliteDatabase(path, opened));
  if (result != SQLITE_OK) return database->failure();
  sqlite3_extended_result_codes(opened, 1);
  int chunk = kChunkBytes, is_log_kept = 1;
  sqlite3_file_control(opened, "main", SQLITE_FCNTL_CHUNK_SIZE, &chunk);
  sqlite3_file_control(opened, "main", SQLITE_FCNTL_PERSIST_WAL, &is_log_kept);
  // The file is locked exclusively from its first use, so there is no shared memory with other processes,
  // which would be another file. Every commit is on the disk when it returns. Debian's SQLite overwrites
  // deleted data, so a deletion would take as much of the log as the data.
  const absl::Status set = database->run(
      absl::StrCat("PRAGMA locking_mode=EXCLUSIVE; PRAGMA auto_vacuum=INCREMENTAL; PRAGMA journal_mode=WAL;"
                   "PRAGMA synchronous=FULL; PRAGMA secure_delete=FAST; PRAGMA journal_size_limit=",
                   kLogBytes,
                   "; PRAGMA trusted_schema=OFF; PRAGMA cell_size_check=ON; BEGIN EXCLUSIVE; COMMIT")
          .c_str());
  if (!set.ok()) return set;
  return database;
}

/// Reserves the log's blocks once. SQLite reads a log up to the first invalid frame, and overwrites it from
/// the beginning again and again.
absl::Status SqliteDatabase::reserve_log() {
  if (has_log_) return absl::OkStatus();
  const std::string log = path_ + "-wal";
  const int fd = ::open(log.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, S_IRUSR | S_IWUSR);
  if (fd < 0) return failed(log, errno);
  const absl::Cleanup close_it = [fd] { close(fd); };
  int error = 0;
  do error = posix_fallocate(fd, 0, kLogBytes);
  while (error == EINTR);
  if (error == 0 && fsync(fd) != 0) error = errno;
  if (error != 0) return failed(log, error);
  has_log_ = true;
  return absl::OkStatus();
}

absl::Status SqliteDatabase::grow_to(std::int64_t bytes) {
  sqlite3_int64 size = bytes;
  const int result = sqlite3_file_control(database_.get(), "main", SQLITE_FCNTL_SIZE_HINT, &size);
  if (result == SQLITE_OK) return absl::OkStatus();
  return store_full(absl::StrCat("its file cannot grow (SQLite ", result, ")"), "", path_);
}

/// Copies the whole log into the database, and clears the log's header while no other process can open the
/// database. So the rest of the log is never taken for a part of another database that is put in this one's
/// place. Returns false if that fails.
bool SqliteDatabase::empty_log() {
  int frames = 0, copied = 0;
  const int result =
      sqlite3_wal_checkpoint_v2(database_.get(), "main", SQLITE_CHECKPOINT_PASSIVE, &frames, &copied);
  if (result != SQLITE_OK || frames != copied) return false;
  // With a limit, SQLite would truncate the log when it closes it.
  if (!run("PRAGMA journal_size_limit = -1").ok()) return false;
  const int fd = ::open((path_ + "-wal").c_str(), O_WRONLY | O_CLOEXEC);
  if (fd < 0) return false;
  const absl::Cleanup close_it = [fd] { close(fd); };
  const std::array<char, kLogHeaderBytes> nothing{};
  return pwrite(fd, nothing.data(), nothing.size(), 0) == static_cast<ssize_t>(nothing.size());
}

bool SqliteDatabase::is_in_place() const {
  int has_moved = 0;
  const int result = sqlite3_file_control(database_.get(), "main", SQLITE_FCNTL_HAS_MOVED, &has_moved);
  return result != SQLITE_OK || has_moved == 0;
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
  // SQLite rolls some failures back by itself; then there is nothing to roll back, and the error is ignored.
  if (database_ != nullptr) database_->run("ROLLBACK").IgnoreError();
}

absl::Status SqliteTransaction::commit() {
  absl::Status status = database_->run("COMMIT");
  if (status.ok()) database_ = nullptr;
  return status;
}

}  // namespace lpdeform
