#pragma once

#include <cstddef>
#include <cstdint>

namespace lpdeform {

/// x, y, z and padding of a row of three right-hand sides: one vector register.
using SolveRow = float __attribute__((vector_size(16)));

/// Consecutive columns of a factor L with the same pattern: a full triangle and, below it, `row_count` rows. The values
/// are row-major and `columns` wide: first the triangle's rows, with inverted diagonal entries, then those below it.
struct Supernode {
  std::int32_t first_column, columns;
  std::size_t first_row, row_count;  // where its rows below the triangle are among all rows
  std::size_t first_value;           // where its values are among all values
};

/// work = L^-1 work for the columns of the supernodes from `first` to before `end`, ascending. `rows` says where in
/// `work` each row below a triangle is; it may be in another place than L's row. Uses fused multiply-add if it can.
void solve_forward(const Supernode* first, const Supernode* end, const float* values,
                   const std::int32_t* rows, SolveRow* work);

/// work = L^-T work for the same columns, descending.
void solve_backward(const Supernode* first, const Supernode* end, const float* values,
                    const std::int32_t* rows, SolveRow* work);

}  // namespace lpdeform
