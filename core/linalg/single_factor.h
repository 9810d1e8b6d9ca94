#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/geometry.h"

namespace lpdeform {

/// A Cholesky factor L of a permuted matrix, P A P^T = L L^T, in single precision: half the bytes of the
/// double one, three right-hand sides at once in vector instructions. Good to about seven digits: for
/// metrics, not for answers. Columns with the same pattern below lie together, as supernodes.
class SingleFactor {
 public:
  // How a backend fills it in: begin(), then its supernodes in ascending order.

  /// For a matrix of this size; its factor will have about `value_count` entries.
  void begin(const std::int32_t* new_to_old, std::size_t size, std::size_t value_count);

  /// The next `columns` columns, whose pattern is a full triangle and, below it, `rows`.
  /// `value(r, c)` is their entry in row r, counted from the triangle's first and on through `rows`.
  template <typename Value>
  void add_supernode(std::int32_t columns, const std::int32_t* rows, std::size_t row_count,
                     const Value& value) {
    float* to = new_supernode(columns, rows, row_count);
    for (std::size_t r = 0; r < columns + row_count; ++r) {
      for (std::size_t c = 0; c < static_cast<std::size_t>(columns); ++c, ++to) {
        *to = r < c ? 0.0f : static_cast<float>(r == c ? 1 / value(r, c) : value(r, c));
      }
    }
  }

  bool empty() const { return new_to_old_.empty(); }
  /// Memory is kept.
  void clear() { new_to_old_.clear(); }

  /// x = A^-1 b. x may be b. One caller at a time.
  void solve(const Points& b, Points& x) const;

  std::size_t memory_bytes() const;

  /// x, y, z and padding: a register of vector instructions.
  using Row = float __attribute__((vector_size(16)));

 private:
  struct Supernode {
    std::int32_t first_column, columns;
    std::size_t first_row, row_count;  // of all rows
    std::size_t first_value;           // of all values
  };
  void solve_forward(Row* x) const;
  void solve_backward(Row* x) const;
  float* new_supernode(std::int32_t columns, const std::int32_t* rows, std::size_t row_count);

  std::vector<std::int32_t> new_to_old_;
  std::vector<Supernode> supernodes_;
  std::vector<std::int32_t> rows_;
  std::vector<float> values_;  // of each supernode: its triangle's rows at full length, then those below, all
                               // row-major; the diagonal inverted
  std::int32_t next_column_ = 0;
  mutable std::vector<Row> work_;
};

}  // namespace lpdeform
