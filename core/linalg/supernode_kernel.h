#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace lpdeform {

/// Rows of an eliminated supernode, row-major with `columns` numbers each, and where they lie in the matrix.
struct EliminatedRows {
  const float* values;
  const std::int32_t* rows;  // ascending
  std::size_t columns;
};

/// block -= A B^T where A are rows begin to end - 1 of `from` and B its first `target_count` rows, which are
/// columns of the block: row r of the matrix is row place[r] of the block, column c its column c - first_column.
/// Above the block's diagonal the result is without meaning. In vector instructions, the widest that the
/// processor has. `scratch` is grown as needed.
void subtract_update(const EliminatedRows& from, std::size_t target_count, std::size_t begin, std::size_t end,
                     const std::int32_t* place, std::int32_t first_column, float* block, std::size_t stride,
                     std::vector<float>& scratch);

/// A lower triangle in the form that rows below it are solved with.
class SolvingTriangle {
 public:
  /// Replaces the symmetric matrix whose lower triangle is in `triangle`, row-major, by its Cholesky factor with
  /// the diagonal inverted. False where a pivot is not above `lowest[c]`, or not a number.
  [[nodiscard]] bool factor(float* triangle, std::size_t columns, const float* lowest);

  /// Replaces each of `row_count` rows b of as many columns by the x with L x = b, after factor(). `scratch` is
  /// grown as needed.
  void solve_rows(float* rows, std::size_t row_count, std::vector<float>& scratch) const;

 private:
  std::size_t columns_ = 0, stride_ = 0;
  std::vector<float> transposed_;  // [c][r]: L(r, c) for r > c, otherwise 0
  std::vector<float> inverse_diagonal_;
  std::vector<float> row_;
};

}  // namespace lpdeform
