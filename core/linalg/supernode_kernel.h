#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace lpdeform {

/// Rows of an eliminated supernode, row-major with `columns` numbers each, and their row indices in the matrix.
struct EliminatedRows {
  const float* values;
  const std::int32_t* rows;  // ascending
  std::size_t columns;
};

/// block -= A B^T. A is rows begin to end - 1 of `from`. B is its first `target_count` rows, which are columns of the
/// block. Row r of the matrix is row place[r] of the block, and column c of the matrix is column c - first_column of
/// the block. Above the block's diagonal the result is undefined. Uses the widest vector instructions that the
/// processor has. `scratch` grows as needed.
void subtract_update(const EliminatedRows& from, std::size_t target_count, std::size_t begin, std::size_t end,
                     const std::int32_t* place, std::int32_t first_column, float* block, std::size_t stride,
                     std::vector<float>& scratch);

/// A lower triangle, stored in the form that is needed to solve the rows below it.
class SolvingTriangle {
 public:
  /// Replaces the symmetric matrix whose lower triangle is in `triangle`, row-major, by its Cholesky factor with the
  /// diagonal inverted. False if a pivot is not above `lowest[c]` or is NaN. If `raised` is not null, pivots within
  /// `lowest[c]` of zero are raised to it instead, and counted there.
  [[nodiscard]] bool factor(float* triangle, std::size_t columns, const float* lowest, int* raised = nullptr);

  /// Replaces each of `row_count` rows b, of as many columns as the triangle, by the x with L x = b. Call factor()
  /// first. `scratch` grows as needed.
  void solve_rows(float* rows, std::size_t row_count, std::vector<float>& scratch) const;

 private:
  std::size_t columns_ = 0, stride_ = 0;
  std::vector<float> transposed_;  // [c][r]: L(r, c) for r > c, otherwise 0
  std::vector<float> inverse_diagonal_;
  std::vector<float> row_;
};

}  // namespace lpdeform
