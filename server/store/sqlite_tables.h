#pragma once

#include <array>
#include <cstddef>
#include <memory>

#include "absl/status/statusor.h"
#include "server/store/sqlite_database.h"

namespace lpdeform {

/// The statements of the SQLite store.
enum class Sql {
  kInsertSession,
  kAdvanceSession,
  kFindSession,
  kRemoveSession,
  kPutPart,
  kRemovePart,
  kRemoveSomeParts,  // at most kPartsAtOnce
  kParts,
  kPartsOfNobody,
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

/// Parts that one transaction removes: few enough that it fits into the log, wherever in the file the parts
/// are.
inline constexpr int kPartsAtOnce = 256;

/// Creates the tables of a new database, or checks those of an existing one. STORE_FAILING if the database is
/// damaged or of another version; STORE_FULL.
absl::Status make_tables(SqliteDatabase& database);

using SqliteStatements = std::array<std::unique_ptr<SqliteStatement>, static_cast<std::size_t>(Sql::kCount)>;
/// Prepares all statements, for a database that has the tables.
absl::StatusOr<SqliteStatements> prepare_statements(const SqliteDatabase& database);

}  // namespace lpdeform
