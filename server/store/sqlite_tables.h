#pragma once

#include <array>
#include <cstddef>
#include <memory>

#include "absl/status/statusor.h"
#include "server/store/sqlite_database.h"

namespace lpdeform {

/// What the SQLite store asks its database.
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

/// Parts that are removed at once: few enough that a transaction of it fits into the log, wherever in the file they are.
inline constexpr int kPartsAtOnce = 256;

/// Makes the tables of a new database; looks through one that was there. STORE_FAILING where it is damaged or of another version,
/// STORE_FULL.
absl::Status make_tables(SqliteDatabase& database);

using SqliteStatements = std::array<std::unique_ptr<SqliteStatement>, static_cast<std::size_t>(Sql::kCount)>;
/// All of them, of a database that has the tables.
absl::StatusOr<SqliteStatements> prepare_statements(const SqliteDatabase& database);

}  // namespace lpdeform
