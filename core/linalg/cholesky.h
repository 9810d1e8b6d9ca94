#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/geometry.h"
#include "core/linalg/single_factor.h"

namespace lpdeform {

/// The lower triangle, diagonal included, of a symmetric matrix by compressed columns; rows ascend within a
/// column and begin with the diagonal.
struct LowerMatrix {
  std::vector<std::int32_t> columns;  // n + 1 offsets
  std::vector<std::int32_t> rows;
  std::vector<double> values;

  std::int32_t size() const { return static_cast<std::int32_t>(columns.size()) - 1; }
};

/// Where a factor's entries lie. Supernode k is columns first_columns[k] to first_columns[k + 1] - 1: a full
/// triangle, and below it rows[first_rows[k]] to rows[first_rows[k + 1] - 1], ascending. Counted in the new order.
struct SupernodePattern {
  std::vector<std::int32_t> new_to_old;
  std::vector<std::int32_t> first_columns;
  std::vector<std::size_t> first_rows;
  std::vector<std::int32_t> rows;
};

/// A fill-reducing order and the factor's pattern in it, by the backend. None where it does not work with
/// supernodes (Eigen). INVALID_ARGUMENT (FACTOR_TOO_LARGE) where the factor has more than `most` entries, which is as far as
/// the backend counts: a triangulated surface of millions of vertices has fewer, one that is glued together at random
/// has that many with 300,000.
absl::StatusOr<std::optional<SupernodePattern>> analyse_supernodes(
    const LowerMatrix& pattern, std::size_t most = std::numeric_limits<std::int32_t>::max());

/// What the supernodes hold, explicit zeros included.
std::size_t entry_count(const SupernodePattern& supernodes);

/// Sparse Cholesky factorisation of symmetric positive definite matrices of one pattern. The constructor
/// orders and analyses; factor() is the numeric phase alone and may be repeated; then solve as often as you
/// like. Behind it stands CHOLMOD or Eigen, by the build. Fill-reducing permutations stay inside. One caller
/// at a time; different objects are independent.
class SparseCholesky {
 public:
  /// Values are not looked at. O(n) memory besides the analysis.
  explicit SparseCholesky(const LowerMatrix& pattern);
  /// In an order that analyse_supernodes() found: the analysis without its longest part.
  SparseCholesky(const LowerMatrix& pattern, const std::vector<std::int32_t>& new_to_old);
  ~SparseCholesky();
  SparseCholesky(SparseCholesky&&) noexcept;
  SparseCholesky& operator=(SparseCholesky&&) noexcept;

  /// False where the matrix is not positive definite to rounding, or not finite; solve() must not be called
  /// then.
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
