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

/// An SQLite database file of this process's own, which nobody but its user may read, in WAL mode with synchronous=FULL. For one thread
/// at a time. Errors are UNAVAILABLE STORE_FAILING with what SQLite says; RESOURCE_EXHAUSTED STORE_FULL where there is no room.
///
/// Its log (`-wal`) is of kLogBytes and on the disk from the beginning, also while nobody has the database open: whatever else fills
/// the disk, changes that fit into it can be made, as long as the file need not grow. See SqliteRoom for that.
class SqliteDatabase {
 public:
  static constexpr std::int64_t kLogBytes = std::int64_t{16} << 20;
  /// The file is always a multiple of this, once it has grown.
  static constexpr int kChunkBytes = 1 << 20;

  /// Opens the file, or makes it. Nobody else may have it open.
  static absl::StatusOr<std::unique_ptr<SqliteDatabase>> open(const std::string& path);
  /// Empties the log, and leaves it where it is.
  ~SqliteDatabase();

  /// Gives the log its bytes, where it does not have them yet. STORE_FULL.
  absl::Status reserve_log();
  /// Makes the file this long at least, in blocks of the disk. STORE_FULL; then it may have become longer by less.
  absl::Status grow_to(std::int64_t bytes);

  /// Whether its file is where it was opened: what is written into one that was removed or moved goes with this process.
  bool is_in_place() const;

  /// Runs statements that give no rows, separated by semicolons.
  absl::Status run(const char* statements);

  /// One number out of a statement that gives one.
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
  bool has_log_ = false;  // of kLogBytes
};

/// A statement, prepared once and run often. Parameters count from 1, columns from 0.
class SqliteStatement {
 public:
  static absl::StatusOr<SqliteStatement> prepare(const SqliteDatabase& database, const char* sql);

  /// Values for the next run; they must live until it is over.
  void bind(int parameter, std::string_view text);
  void bind_blob(int parameter, std::string_view bytes);
  void bind(int parameter, std::int64_t number);

  /// The next row: false where there is none. After false or an error the statement can be run again.
  absl::StatusOr<bool> step();
  /// Runs a statement that gives no rows.
  absl::Status run();
  /// Ends a run early.
  void reset();

  std::string text(int column) const;
  std::int64_t number(int column) const;
  /// Rows that the last run changed.
  int changes() const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  SqliteStatement(const SqliteDatabase& database, sqlite3_stmt* statement);

  const SqliteDatabase* database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

/// A transaction: undone unless it is committed.
class SqliteTransaction {
 public:
  static absl::StatusOr<SqliteTransaction> begin(SqliteDatabase& database);
  SqliteTransaction(SqliteTransaction&& other) noexcept;
  ~SqliteTransaction();

  /// Durable once it has returned OK.
  absl::Status commit();

 private:
  explicit SqliteTransaction(SqliteDatabase& database) : database_(&database) {}

  SqliteDatabase* database_;  // null once over
};

}  // namespace lpdeform
