#include "core/linalg/single_factor.h"

#include <algorithm>
#include <cmath>

namespace lpdeform {
namespace {

using Row = SingleFactor::Row;

/// x = L^-1 b for a supernode's own rows: a triangle, row-major, its diagonal inverted.
void solve_triangle(const float* values, std::int32_t columns, Row* own) {
  for (std::int32_t r = 0; r < columns; ++r, values += columns) {
    for (std::int32_t c = 0; c < r; ++c) own[r] -= values[c] * own[c];
    own[r] *= values[r];
  }
}

void solve_transposed_triangle(const float* values, std::int32_t columns, Row* own) {
  for (std::int32_t r = columns; r-- > 0;) {
    const float* const row = values + static_cast<std::size_t>(r) * static_cast<std::size_t>(columns);
    own[r] *= row[r];
    for (std::int32_t c = 0; c < r; ++c) own[c] -= row[c] * own[r];
  }
}

}  // namespace

void SingleFactor::begin(const std::int32_t* new_to_old, std::size_t size, std::size_t value_count) {
  new_to_old_.assign(new_to_old, new_to_old + size);
  supernodes_.clear();
  rows_.clear();
  values_.clear();
  values_.reserve(value_count);
  next_column_ = 0;
  work_.resize(size);
}

float* SingleFactor::new_supernode(std::int32_t columns, const std::int32_t* rows, std::size_t row_count) {
  supernodes_.push_back({next_column_, columns, rows_.size(), row_count, values_.size()});
  rows_.insert(rows_.end(), rows, rows + row_count);
  next_column_ += columns;
  values_.resize(values_.size() + static_cast<std::size_t>(columns) * (columns + row_count));
  return values_.data() + supernodes_.back().first_value;
}

/// x = L^-1 b in place.
void SingleFactor::solve_forward(Row* x) const {
  for (const Supernode& node : supernodes_) {
    Row* const own = x + node.first_column;
    const float* values = values_.data() + node.first_value;
    solve_triangle(values, node.columns, own);
    values += static_cast<std::size_t>(node.columns) * static_cast<std::size_t>(node.columns);
    for (std::size_t r = 0; r < node.row_count; ++r, values += node.columns) {
      Row sum = x[rows_[node.first_row + r]];
      for (std::int32_t c = 0; c < node.columns; ++c) sum -= values[c] * own[c];
      x[rows_[node.first_row + r]] = sum;
    }
  }
}

/// x = L^-T b in place.
void SingleFactor::solve_backward(Row* x) const {
  for (auto node = supernodes_.rbegin(); node != supernodes_.rend(); ++node) {
    Row* const own = x + node->first_column;
    const float* const triangle = values_.data() + node->first_value;
    const float* values =
        triangle + static_cast<std::size_t>(node->columns) * static_cast<std::size_t>(node->columns);
    for (std::size_t r = 0; r < node->row_count; ++r, values += node->columns) {
      const Row below = x[rows_[node->first_row + r]];
      for (std::int32_t c = 0; c < node->columns; ++c) own[c] -= values[c] * below;
    }
    solve_transposed_triangle(triangle, node->columns, own);
  }
}

void SingleFactor::solve(const Points& b, Points& x) const {
  // Over the largest entry, so that no size of b leaves the range of single precision.
  const double largest = b.cwiseAbs().maxCoeff(), scale = 1 / largest;
  x.resize(b.rows(), 3);
  if (!std::isfinite(scale)) return void(x.setZero());
  for (std::size_t i = 0; i < new_to_old_.size(); ++i) {
    const double* const row = b.data() + 3 * static_cast<std::size_t>(new_to_old_[i]);
    work_[i] = Row{static_cast<float>(scale * row[0]), static_cast<float>(scale * row[1]),
                   static_cast<float>(scale * row[2]), 0};
  }
  solve_forward(work_.data());
  solve_backward(work_.data());
  for (std::size_t i = 0; i < new_to_old_.size(); ++i) {
    double* const row = x.data() + 3 * static_cast<std::size_t>(new_to_old_[i]);
    for (int c = 0; c < 3; ++c) row[c] = largest * static_cast<double>(work_[i][c]);
  }
}

std::size_t SingleFactor::memory_bytes() const {
  return (new_to_old_.capacity() + rows_.capacity()) * sizeof(std::int32_t) +
         supernodes_.capacity() * sizeof(Supernode) + values_.capacity() * sizeof(float) +
         work_.capacity() * sizeof(Row);
}

}  // namespace lpdeform
