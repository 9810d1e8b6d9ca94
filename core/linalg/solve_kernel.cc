#include "core/linalg/solve_kernel.h"

// This file is compiled once for each instruction set. The first call decides which version runs.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#ifdef __aarch64__  // once: Arm's sets of fixed width do the same here, and vectors of SVE can be in no arrays
#define HWY_COMPILE_ONLY_STATIC
#endif
#define HWY_TARGET_INCLUDE "core/linalg/solve_kernel.cc"
#include <hwy/foreach_target.h>

#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace lpdeform::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR  // its vectors hold one number, but every processor that we build for has four
using V = SolveRow;
HWY_INLINE V zero() {
  return V{};
}
HWY_INLINE V load(const SolveRow& row) {
  return row;
}
HWY_INLINE void store(V value, SolveRow& row) {
  row = value;
}
HWY_INLINE V add(V a, V b) {
  return a + b;
}
HWY_INLINE V product(float factor, V value) {
  return factor * value;
}
HWY_INLINE V minus_product(V sum, float factor, V value) {
  return sum - factor * value;
}
#else
using D = hn::FixedTag<float, 4>;
using V = hn::Vec<D>;
HWY_INLINE V zero() {
  return hn::Zero(D());
}
HWY_INLINE V load(const SolveRow& row) {
  return hn::Load(D(), reinterpret_cast<const float*>(&row));
}
HWY_INLINE void store(V value, SolveRow& row) {
  hn::Store(value, D(), reinterpret_cast<float*>(&row));
}
HWY_INLINE V add(V a, V b) {
  return hn::Add(a, b);
}
HWY_INLINE V product(float factor, V value) {
  return hn::Mul(hn::Set(D(), factor), value);
}
HWY_INLINE V minus_product(V sum, float factor, V value) {
  return hn::NegMulAdd(hn::Set(D(), factor), value, sum);
}
#endif

/// How many supernodes ahead values are fetched. Those of a large factor are in no cache, and processors do not read ahead beyond the end
/// of a page.
constexpr std::ptrdiff_t kAhead = 2;

HWY_INLINE void fetch(const Supernode& node, const float* all_values) {
  constexpr std::size_t kLine = 64 / sizeof(float);
  const auto columns = static_cast<std::size_t>(node.columns);
  const float* const values = all_values + node.first_value;
  for (std::size_t k = 0; k < columns * (columns + node.row_count); k += kLine) hwy::Prefetch(values + k);
}

// Rows are taken eight or four at a time, so that their sums do not wait for each other.

/// sums[k] -= sum over c of values[k][c] own[c]. The rows of values are `stride` apart.
template <std::size_t kRows>
HWY_INLINE void subtract_products(const float* values, std::size_t stride, std::size_t columns,
                                  const SolveRow* own, V* sums) {
  for (std::size_t c = 0; c < columns; ++c) {
    const V x = load(own[c]);
    for (std::size_t k = 0; k < kRows; ++k) sums[k] = minus_product(sums[k], values[k * stride + c], x);
  }
}

/// below[rows[k]] -= sum over c of values[k][c] own[c].
template <std::size_t kRows>
HWY_INLINE void subtract_below(const float* values, std::size_t columns, const std::int32_t* rows,
                               const SolveRow* own, SolveRow* below) {
  V sums[kRows];
  for (std::size_t k = 0; k < kRows; ++k) sums[k] = zero();
  subtract_products<kRows>(values, columns, columns, own, sums);
  for (std::size_t k = 0; k < kRows; ++k) store(add(load(below[rows[k]]), sums[k]), below[rows[k]]);
}

/// own = L^-1 own for rows r to r + kRows - 1 of the triangle L; those above are done.
template <std::size_t kRows>
HWY_INLINE void solve_rows(const float* triangle, std::size_t columns, std::size_t r, SolveRow* own) {
  const float* const values = triangle + r * columns;
  V sums[kRows];
  for (std::size_t k = 0; k < kRows; ++k) sums[k] = load(own[r + k]);
  subtract_products<kRows>(values, columns, r, own, sums);
  for (std::size_t k = 0; k < kRows; ++k) {
    for (std::size_t j = 0; j < k; ++j)
      sums[k] = minus_product(sums[k], values[k * columns + r + j], sums[j]);
    sums[k] = product(values[k * columns + r + k], sums[k]);
    store(sums[k], own[r + k]);
  }
}

void SolveForward(const Supernode* first, const Supernode* end, const float* all_values,
                  const std::int32_t* all_rows, SolveRow* work) {
  for (; first != end; ++first) {
    if (end - first > kAhead) fetch(first[kAhead], all_values);
    const auto columns = static_cast<std::size_t>(first->columns);
    SolveRow* const own = work + first->first_column;
    const float* values = all_values + first->first_value;
    std::size_t r = 0;
    for (; r + 4 <= columns; r += 4) solve_rows<4>(values, columns, r, own);
    for (; r < columns; ++r) solve_rows<1>(values, columns, r, own);
    values += columns * columns;
    const std::int32_t* rows = all_rows + first->first_row;
    std::size_t left = first->row_count;
    for (; left >= 8; left -= 8, rows += 8, values += 8 * columns)
      subtract_below<8>(values, columns, rows, own, work);
    if (left >= 4) {
      subtract_below<4>(values, columns, rows, own, work);
      left -= 4, rows += 4, values += 4 * columns;
    }
    for (; left > 0; --left, ++rows, values += columns) subtract_below<1>(values, columns, rows, own, work);
  }
}

/// own[c] -= sum over k of values[k][c] x[k].
template <std::size_t kRows>
HWY_INLINE void subtract_transposed(const float* values, std::size_t stride, std::size_t columns, const V* x,
                                    SolveRow* own) {
  for (std::size_t c = 0; c < columns; ++c) {
    V sum = load(own[c]);
    for (std::size_t k = 0; k < kRows; ++k) sum = minus_product(sum, values[k * stride + c], x[k]);
    store(sum, own[c]);
  }
}

/// own[c] -= sum over k of values[k][c] below[rows[k]].
template <std::size_t kRows>
HWY_INLINE void subtract_from_below(const float* values, std::size_t columns, const std::int32_t* rows,
                                    SolveRow* own, const SolveRow* below) {
  V x[kRows];
  for (std::size_t k = 0; k < kRows; ++k) x[k] = load(below[rows[k]]);
  subtract_transposed<kRows>(values, columns, columns, x, own);
}

/// own = L^-T own for rows r to r + kRows - 1 of the triangle L, which are then taken from the rows above.
template <std::size_t kRows>
HWY_INLINE void solve_transposed_rows(const float* triangle, std::size_t columns, std::size_t r,
                                      SolveRow* own) {
  const float* const values = triangle + r * columns;
  V x[kRows];
  for (std::size_t k = kRows; k-- > 0;) {
    x[k] = load(own[r + k]);
    for (std::size_t j = kRows; j-- > k + 1;) x[k] = minus_product(x[k], values[j * columns + r + k], x[j]);
    x[k] = product(values[k * columns + r + k], x[k]);
    store(x[k], own[r + k]);
  }
  subtract_transposed<kRows>(values, columns, r, x, own);
}

void SolveBackward(const Supernode* first, const Supernode* end, const float* all_values,
                   const std::int32_t* all_rows, SolveRow* work) {
  while (end != first) {
    --end;
    if (end - first >= kAhead) fetch(end[-kAhead], all_values);
    const auto columns = static_cast<std::size_t>(end->columns);
    SolveRow* const own = work + end->first_column;
    const float* const triangle = all_values + end->first_value;
    const float* values = triangle + columns * columns;
    const std::int32_t* rows = all_rows + end->first_row;
    std::size_t left = end->row_count;
    for (; left >= 8; left -= 8, rows += 8, values += 8 * columns)
      subtract_from_below<8>(values, columns, rows, own, work);
    if (left >= 4) {
      subtract_from_below<4>(values, columns, rows, own, work);
      left -= 4, rows += 4, values += 4 * columns;
    }
    for (; left > 0; --left, ++rows, values += columns)
      subtract_from_below<1>(values, columns, rows, own, work);
    std::size_t r = columns;
    for (; r % 4 != 0; --r) solve_transposed_rows<1>(triangle, columns, r - 1, own);
    for (; r > 0; r -= 4) solve_transposed_rows<4>(triangle, columns, r - 4, own);
  }
}

}  // namespace lpdeform::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lpdeform {

HWY_EXPORT(SolveForward);
HWY_EXPORT(SolveBackward);

void solve_forward(const Supernode* first, const Supernode* end, const float* values,
                   const std::int32_t* rows, SolveRow* work) {
  HWY_DYNAMIC_DISPATCH(SolveForward)(first, end, values, rows, work);
}

void solve_backward(const Supernode* first, const Supernode* end, const float* values,
                    const std::int32_t* rows, SolveRow* work) {
  HWY_DYNAMIC_DISPATCH(SolveBackward)(first, end, values, rows, work);
}

}  // namespace lpdeform
#endif  // HWY_ONCE
