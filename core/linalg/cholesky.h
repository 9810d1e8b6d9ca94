#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/geometry.h"
#include "core/linalg/single_factor.h"

namespace lpdeform {

/// The lower triangle of a symmetric matrix, including the diagonal, in compressed-column form. Row indices ascend
/// within a column and begin with the diagonal.
struct LowerMatrix {
  std::vector<std::int32_t> columns;  // n + 1 offsets
  std::vector<std::int32_t> rows;
  std::vector<double> values;

  std::int32_t size() const { return static_cast<std::int32_t>(columns.size()) - 1; }
};

/// A symmetric matrix that is read one row at a time. Several threads may read at once.
class SymmetricRows {
 public:
  struct Entry {
    std::int32_t column;
    double value;
  };
  virtual ~SymmetricRows() = default;

  /// Appends the entries of row i, on both sides of the diagonal and each column once, in any order.
  virtual void append_row(std::int32_t i, std::vector<Entry>& to) const = 0;
};

/// The pattern of a factor's entries. Supernode k is columns first_columns[k] to first_columns[k + 1] - 1: a full
/// triangle and, below it, the rows rows[first_rows[k]] to rows[first_rows[k + 1] - 1], ascending. All indices are in
/// the new order.
struct SupernodePattern {
  std::vector<std::int32_t> new_to_old;
  std::vector<std::int32_t> first_columns;
  std::vector<std::size_t> first_rows;
  std::vector<std::int32_t> rows;
};

/// A fill-reducing ordering and the factor's pattern in that order, found by CHOLMOD or in supernodes.h, as the build
/// chooses. INVALID_ARGUMENT (FACTOR_TOO_LARGE) if the factor has more than `most` entries; the default is
/// CHOLMOD's limit. A triangulated surface of millions of vertices stays below it; a surface that is glued together
/// at random reaches it with 300,000 vertices.
absl::StatusOr<SupernodePattern> analyse_supernodes(
    const LowerMatrix& pattern, std::size_t most = std::numeric_limits<std::int32_t>::max());

/// The number of entries that the supernodes hold, including explicit zeros.
std::size_t entry_count(const SupernodePattern& supernodes);
/// How many multiplications a factorisation takes, up to a factor of two: the sum over its columns of the squared number of entries.
double operation_count(const SupernodePattern& supernodes);

/// Sparse Cholesky factorisation of symmetric positive definite matrices with the same pattern. The constructor does
/// ordering and symbolic analysis. factor() is the numeric phase and may be repeated; after it, solve() may be called
/// any number of times. The backend is CHOLMOD or Eigen, chosen by the build. Fill-reducing permutations stay internal.
/// One caller at a time; different objects are independent.
class SparseCholesky {
 public:
  /// Ignores the values. O(n) memory besides the analysis.
  explicit SparseCholesky(const LowerMatrix& pattern);
  /// Uses an ordering that analyse_supernodes() found, which skips the longest part of the analysis.
  SparseCholesky(const LowerMatrix& pattern, const std::vector<std::int32_t>& new_to_old);
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  /// False if the matrix is not positive definite to rounding, or not finite; then solve() must not be called.
  [[nodiscard]] bool factor(const LowerMatrix& matrix);

  /// x = A^-1 b, three right-hand sides at once. x may be b.
  void solve(const Points& b, Points& x) const;
  /// x = A^-1 b, one right-hand side. x may be b.
  void solve(const Eigen::VectorXd& b, Eigen::VectorXd& x) const;

  /// Writes the factor to `out` in single precision.
  void copy_to(SingleFactor& out) const;

  /// Bytes of the factor and the analysis.
  std::size_t memory_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// "CHOLMOD 3.0.14" or "Eigen 3.4.0".
const char* cholesky_backend();

}  // namespace lpdeform
