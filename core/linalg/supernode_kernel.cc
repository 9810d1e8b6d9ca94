#include "core/linalg/supernode_kernel.h"

// This file is compiled once for each instruction set. The first call decides which version runs.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#ifdef __aarch64__  // once: Arm's sets of fixed width do the same here, and vectors of SVE can be no members
#define HWY_COMPILE_ONLY_STATIC
#endif
#define HWY_TARGET_INCLUDE "core/linalg/supernode_kernel.cc"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace lpdeform::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// At most eight lanes: blocks are narrow.
using D = hn::CappedTag<float, 8>;
using V = hn::Vec<D>;

/// The target columns of an update in the block.
struct Targets {
  const std::int32_t* rows;
  std::size_t count;
  std::int32_t first_column;
  bool lie_together;
};

/// row[target of k] -= values[k] for k from `begin`, `count` of them.
HWY_INLINE void scatter(const float* values, const Targets& to, std::size_t begin, std::size_t count,
                        float* row) {
  if (to.lie_together) {
    float* const at = row + (to.rows[begin] - to.first_column);
    for (std::size_t k = 0; k < count; ++k) at[k] -= values[k];
    return;
  }
  for (std::size_t k = 0; k < count; ++k) row[to.rows[begin + k] - to.first_column] -= values[k];
}

/// Rows i to i + kRows - 1 of A times `kVectors` vectors of columns of B^T from `column` on.
template <std::size_t kRows, std::size_t kVectors>
HWY_INLINE void multiply(const EliminatedRows& a, std::size_t i, const float* packed, std::size_t width,
                         std::size_t column, const Targets& to, const std::int32_t* place, float* block,
                         std::size_t stride) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  V sum[kRows][kVectors];
  for (std::size_t r = 0; r < kRows; ++r) {
    for (std::size_t v = 0; v < kVectors; ++v) sum[r][v] = hn::Zero(d);
  }
  const float* const rows = a.values + i * a.columns;
  for (std::size_t k = 0; k < a.columns; ++k) {
    const float* const b = packed + k * width + column;
    V right[kVectors];
    for (std::size_t v = 0; v < kVectors; ++v) right[v] = hn::LoadU(d, b + v * lanes);
    for (std::size_t r = 0; r < kRows; ++r) {
      const V left = hn::Set(d, rows[r * a.columns + k]);
      for (std::size_t v = 0; v < kVectors; ++v) sum[r][v] = hn::MulAdd(left, right[v], sum[r][v]);
    }
  }
  const std::size_t count = std::min(to.count - column, kVectors * lanes);
  for (std::size_t r = 0; r < kRows; ++r) {
    float* const row = block + static_cast<std::size_t>(place[a.rows[i + r]]) * stride;
    if (to.lie_together && count == kVectors * lanes) {
      float* const at = row + (to.rows[column] - to.first_column);
      for (std::size_t v = 0; v < kVectors; ++v)
        hn::StoreU(hn::Sub(hn::LoadU(d, at + v * lanes), sum[r][v]), d, at + v * lanes);
      continue;
    }
    HWY_ALIGN float values[kVectors * 8];
    for (std::size_t v = 0; v < kVectors; ++v) hn::Store(sum[r][v], d, values + v * lanes);
    scatter(values, to, column, count, row);
  }
}

template <std::size_t kVectors>
HWY_INLINE void multiply_rows(const EliminatedRows& a, std::size_t begin, std::size_t end,
                              const float* packed, std::size_t width, std::size_t column, const Targets& to,
                              const std::int32_t* place, float* block, std::size_t stride) {
  std::size_t i = begin;
  for (; i + 4 <= end; i += 4) multiply<4, kVectors>(a, i, packed, width, column, to, place, block, stride);
  for (; i < end; ++i) multiply<1, kVectors>(a, i, packed, width, column, to, place, block, stride);
}

void SubtractUpdate(const EliminatedRows& from, std::size_t target_count, std::size_t begin, std::size_t end,
                    const std::int32_t* place, std::int32_t first_column, float* block, std::size_t stride,
                    std::vector<float>& scratch) {
  const std::size_t lanes = hn::Lanes(D());
  const std::size_t width = (target_count + lanes - 1) / lanes * lanes;
  if (scratch.size() < from.columns * width) scratch.resize(from.columns * width);
  float* const packed = scratch.data();
  for (std::size_t k = 0; k < from.columns; ++k) {
    for (std::size_t j = target_count; j < width; ++j) packed[k * width + j] = 0;
  }
  for (std::size_t j = 0; j < target_count; ++j) {
    for (std::size_t k = 0; k < from.columns; ++k) packed[k * width + j] = from.values[j * from.columns + k];
  }
  const Targets to{from.rows, target_count, first_column,
                   from.rows[target_count - 1] - from.rows[0] == static_cast<std::int32_t>(target_count) - 1};
  std::size_t column = 0;
  for (; column + lanes < width; column += 2 * lanes)
    multiply_rows<2>(from, begin, end, packed, width, column, to, place, block, stride);
  if (column < width) multiply_rows<1>(from, begin, end, packed, width, column, to, place, block, stride);
}

/// Solves kRows rows of `stride` numbers column by column: computes x(c), then subtracts its contribution from the
/// columns to its right.
template <std::size_t kRows>
HWY_INLINE void substitute(float* rows, std::size_t columns, std::size_t stride, const float* transposed,
                           const float* inverse_diagonal) {
  const D d;
  const std::size_t lanes = hn::Lanes(d);
  for (std::size_t c = 0; c < columns; ++c) {
    V x[kRows];
    for (std::size_t r = 0; r < kRows; ++r) {
      const float value = rows[r * stride + c] *= inverse_diagonal[c];
      x[r] = hn::Set(d, value);
    }
    for (std::size_t j = (c + 1) / lanes * lanes; j < columns; j += lanes) {
      const V l = hn::LoadU(d, transposed + c * stride + j);
      for (std::size_t r = 0; r < kRows; ++r) {
        float* const at = rows + r * stride + j;
        hn::StoreU(hn::NegMulAdd(x[r], l, hn::LoadU(d, at)), d, at);
      }
    }
  }
}

std::size_t PaddedColumns(std::size_t columns) {
  const std::size_t lanes = hn::Lanes(D());
  return (columns + lanes - 1) / lanes * lanes;
}

void SubstituteOne(float* row, std::size_t columns, std::size_t stride, const float* transposed,
                   const float* inverse_diagonal) {
  substitute<1>(row, columns, stride, transposed, inverse_diagonal);
}

void SubstituteRows(float* rows, std::size_t row_count, std::size_t columns, std::size_t stride,
                    const float* transposed, const float* inverse_diagonal, float* padded) {
  for (std::size_t i = 0; i < row_count; i += 4) {
    const std::size_t count = std::min<std::size_t>(4, row_count - i);
    for (std::size_t r = 0; r < count; ++r)
      std::copy_n(rows + (i + r) * columns, columns, padded + r * stride);
    substitute<4>(padded, columns, stride, transposed, inverse_diagonal);
    for (std::size_t r = 0; r < count; ++r)
      std::copy_n(padded + r * stride, columns, rows + (i + r) * columns);
  }
}

}  // namespace lpdeform::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace lpdeform {

HWY_EXPORT(SubtractUpdate);
HWY_EXPORT(PaddedColumns);
HWY_EXPORT(SubstituteOne);
HWY_EXPORT(SubstituteRows);

void subtract_update(const EliminatedRows& from, std::size_t target_count, std::size_t begin, std::size_t end,
                     const std::int32_t* place, std::int32_t first_column, float* block, std::size_t stride,
                     std::vector<float>& scratch) {
  HWY_DYNAMIC_DISPATCH(SubtractUpdate)
  (from, target_count, begin, end, place, first_column, block, stride, scratch);
}

bool SolvingTriangle::factor(float* triangle, std::size_t columns, const float* lowest, int* raised) {
  columns_ = columns;
  stride_ = HWY_DYNAMIC_DISPATCH(PaddedColumns)(columns);
  transposed_.assign(columns * stride_, 0);
  inverse_diagonal_.resize(columns);
  row_.assign(stride_, 0);
  for (std::size_t r = 0; r < columns; ++r) {
    float* const row = triangle + r * columns;
    std::copy_n(row, r + 1, row_.begin());
    std::fill(row_.begin() + static_cast<std::ptrdiff_t>(r) + 1, row_.end(), 0.0f);
    float pivot = row[r];
    if (r > 0) {
      HWY_DYNAMIC_DISPATCH(SubstituteOne)
      (row_.data(), r, stride_, transposed_.data(), inverse_diagonal_.data());
      for (std::size_t c = 0; c < r; ++c) pivot -= row_[c] * row_[c];
    }
    if (!(pivot > lowest[r])) {
      const bool is_rounding = pivot > -lowest[r] && std::isfinite(lowest[r]);
      if (raised == nullptr || !is_rounding) return false;
      pivot = lowest[r];
      ++*raised;
    }
    inverse_diagonal_[r] = 1 / std::sqrt(pivot);
    std::copy_n(row_.begin(), r, row);
    row[r] = inverse_diagonal_[r];
    for (std::size_t c = 0; c < r; ++c) transposed_[c * stride_ + r] = row[c];
  }
  return true;
}

void SolvingTriangle::solve_rows(float* rows, std::size_t row_count, std::vector<float>& scratch) const {
  if (columns_ == 1) {
    for (std::size_t r = 0; r < row_count; ++r) rows[r] *= inverse_diagonal_[0];
    return;
  }
  if (scratch.size() < 4 * stride_) scratch.resize(4 * stride_);
  HWY_DYNAMIC_DISPATCH(SubstituteRows)
  (rows, row_count, columns_, stride_, transposed_.data(), inverse_diagonal_.data(), scratch.data());
}

}  // namespace lpdeform
#endif  // HWY_ONCE
