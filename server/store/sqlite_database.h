#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

struct sqlite3;
struct sqlite3_stmt;

namespace lpdeform {

/// An SQLite database file that only this process uses and only its user may read, in WAL mode with
/// synchronous=FULL. For one thread at a time. Errors are UNAVAILABLE STORE_FAILING with the message of
/// SQLite, or RESOURCE_EXHAUSTED STORE_FULL if there is no room.
///
/// Its log (`-wal`) has kLogBytes and its blocks on the disk from the beginning, also while the database is
/// closed. So changes that fit into the log can be made even if other programs have filled the disk, as long
/// as the file need not grow. SqliteRoom takes care of the latter.
class SqliteDatabase {
 public:
  static constexpr std::int64_t kLogBytes = std::int64_t{16} << 20;
  /// Once the file has grown, its size is always a multiple of this.
  static constexpr int kChunkBytes = 1 << 20;

  /// Opens the file, or creates it. No other process may have it open.
  static absl::StatusOr<std::unique_ptr<SqliteDatabase>> open(const std::string& path);
  /// Empties the log, and leaves its file in place.
  ~SqliteDatabase();

  /// Reserves the log's blocks on the disk, unless that is done. STORE_FULL.
  absl::Status reserve_log();
  /// Makes the file at least this long, with blocks on the disk. STORE_FULL; then the file may have grown by
  /// a smaller amount.
  absl::Status grow_to(std::int64_t bytes);

  /// Whether the file is still where it was opened. Data written into a file that was removed or moved is
  /// lost when this process ends.
  bool is_in_place() const;

  /// Runs statements that return no rows, separated by semicolons.
  absl::Status run(const char* statements);

  /// The number that a statement with one result returns.
  absl::StatusOr<std::int64_t> number(const char* statement);

  std::string path() const { return path_; }

 private:
  friend class SqliteStatement;
  struct Close {
    void operator()(sqlite3* database) const;
  };
  SqliteDatabase(std::string path, sqlite3* database);
  absl::Status failure() const;

  bool empty_log();

  std::string path_;
  std::unique_ptr<sqlite3, Close> database_;
  bool has_log_ = false;  // the log has kLogBytes
};

/// A statement, prepared once and run often. Parameters count from 1, columns from 0.
class SqliteStatement {
 public:
  static absl::StatusOr<SqliteStatement> prepare(const SqliteDatabase& database, const char* sql);

  /// Binds values for the next run; they must live until it is over.
  void bind(int parameter, std::string_view text);
  void bind_blob(int parameter, std::string_view bytes);
  void bind(int parameter, std::int64_t number);

  /// Steps to the next row; false if there is none. After false or an error the statement can be run again.
  absl::StatusOr<bool> step();
  /// Runs a statement that returns no rows.
  absl::Status run();
  /// Ends a run early.
  void reset();

  std::string text(int column) const;
  std::int64_t number(int column) const;
  /// How many rows the last run changed.
  int changes() const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  SqliteStatement(const SqliteDatabase& database, sqlite3_stmt* statement);

  const SqliteDatabase* database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

/// A transaction, rolled back unless it is committed.
class SqliteTransaction {
 public:
  static absl::StatusOr<SqliteTransaction> begin(SqliteDatabase& database);
  SqliteTransaction(SqliteTransaction&& other) noexcept;
  ~SqliteTransaction();

  /// After OK the changes are durable.
  absl::Status commit();

 private:
  explicit SqliteTransaction(SqliteDatabase& database) : database_(&database) {}

  SqliteDatabase* database_;  // null once the transaction is over
};

}  // namespace lpdeform
