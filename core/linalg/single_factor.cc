#include "core/linalg/single_factor.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lpdeform {
namespace {

using Row = SingleFactor::Row;

constexpr std::size_t kBranches = 16;
constexpr std::size_t kSmallestBranch = 1 << 14;  // entries; a smaller one is not worth a task
constexpr std::size_t kChunk = 4096;              // rows

/// x = L^-1 b for a supernode's own rows. `values` is a row-major triangle with inverted diagonal entries.
void solve_triangle(const float* values, std::int32_t columns, Row* own) {
  for (std::int32_t r = 0; r < columns; ++r, values += columns) {
    Row sum = own[r];
    for (std::int32_t c = 0; c < r; ++c) sum -= values[c] * own[c];
    own[r] = sum * values[r];
  }
}

void solve_transposed_triangle(const float* values, std::int32_t columns, Row* own) {
  for (std::int32_t r = columns; r-- > 0;) {
    const float* const row = values + static_cast<std::size_t>(r) * static_cast<std::size_t>(columns);
    const Row x = own[r] *= row[r];
    for (std::int32_t c = 0; c < r; ++c) own[c] -= row[c] * x;
  }
}

/// below[rows[r]] -= sum_c values[r][c] own[c]; Four rows at a time, so that the sums are independent of each other.
void add_below(const float* values, std::int32_t columns, const std::int32_t* rows, std::size_t row_count,
               const Row* own, Row* below) {
  std::size_t r = 0;
  for (; r + 4 <= row_count; r += 4, values += 4 * columns) {
    Row sum[4] = {};
    for (std::int32_t c = 0; c < columns; ++c) {
      for (int k = 0; k < 4; ++k) sum[k] += values[k * columns + c] * own[c];
    }
    for (int k = 0; k < 4; ++k) below[rows[r + k]] -= sum[k];
  }
  for (; r < row_count; ++r, values += columns) {
    Row sum = {};
    for (std::int32_t c = 0; c < columns; ++c) sum += values[c] * own[c];
    below[rows[r]] -= sum;
  }
}

/// own[c] -= sum_r values[r][c] below[rows[r]].
void add_from_below(const float* values, std::int32_t columns, const std::int32_t* rows,
                    std::size_t row_count, Row* own, const Row* below) {
  std::size_t r = 0;
  for (; r + 4 <= row_count; r += 4, values += 4 * columns) {
    const Row b0 = below[rows[r]], b1 = below[rows[r + 1]], b2 = below[rows[r + 2]], b3 = below[rows[r + 3]];
    for (std::int32_t c = 0; c < columns; ++c) {
      own[c] -= (values[c] * b0 + values[columns + c] * b1) +
                (values[2 * columns + c] * b2 + values[3 * columns + c] * b3);
    }
  }
  for (; r < row_count; ++r, values += columns) {
    const Row x = below[rows[r]];
    for (std::int32_t c = 0; c < columns; ++c) own[c] -= values[c] * x;
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
}

float* SingleFactor::new_supernode(std::int32_t columns, const std::int32_t* rows, std::size_t row_count) {
  supernodes_.push_back({next_column_, columns, rows_.size(), row_count, values_.size()});
  rows_.insert(rows_.end(), rows, rows + row_count);
  next_column_ += columns;
  values_.resize(values_.size() + static_cast<std::size_t>(columns) * (columns + row_count));
  return values_.data() + supernodes_.back().first_value;
}

/// The supernode of each column.
std::vector<std::int32_t> SingleFactor::node_of_columns() const {
  std::vector<std::int32_t> result(new_to_old_.size());
  for (std::size_t k = 0; k < supernodes_.size(); ++k) {
    std::fill_n(result.begin() + supernodes_[k].first_column, supernodes_[k].columns,
                static_cast<std::int32_t>(k));
  }
  return result;
}

/// The parent of each supernode in the elimination tree: the supernode that contains its first row below the triangle;
/// -1 for roots.
std::vector<std::int32_t> SingleFactor::parents() const {
  const std::vector<std::int32_t> node_of = node_of_columns();
  std::vector<std::int32_t> result(supernodes_.size(), -1);
  for (std::size_t k = 0; k < supernodes_.size(); ++k) {
    if (supernodes_[k].row_count > 0) result[k] = node_of[rows_[supernodes_[k].first_row]];
  }
  return result;
}

/// Cuts the tree where the subtrees become small enough, and groups these into branches of about equal size.
void SingleFactor::cut_branches() {
  branches_.clear();
  trunk_.clear();
  const auto count = static_cast<std::int32_t>(supernodes_.size());
  const std::vector<std::int32_t> parent = parents();
  std::vector<std::size_t> work(count), nodes(count, 1);  // of the subtree rooted at each supernode
  std::vector<char> is_whole(count, true);  // this subtree, and each in it, has consecutive supernodes
  std::vector<std::int32_t> first(count);
  for (std::int32_t k = 0; k < count; ++k) first[k] = k;
  for (std::int32_t k = 0; k < count; ++k) {
    const Supernode& node = supernodes_[k];
    work[k] +=
        static_cast<std::size_t>(node.columns) * (static_cast<std::size_t>(node.columns) + node.row_count);
    is_whole[k] = is_whole[k] && nodes[k] == static_cast<std::size_t>(k - first[k] + 1);
    if (parent[k] < 0) continue;
    is_whole[parent[k]] = is_whole[parent[k]] && is_whole[k];
    work[parent[k]] += work[k];
    nodes[parent[k]] += nodes[k];
    first[parent[k]] = std::min(first[parent[k]], first[k]);
  }
  const std::size_t most = std::max(values_.size() / kBranches, kSmallestBranch);
  const bool is_worth_it = values_.size() >= 4 * kSmallestBranch;
  const auto is_branch = [&](std::int32_t k) { return is_worth_it && work[k] <= most && is_whole[k]; };
  std::size_t bundled = most;
  for (std::int32_t k = 0; k < count; ++k) {
    if (is_branch(k) && parent[k] >= 0 && is_branch(parent[k])) continue;  // part of its parent's branch
    if (!is_branch(k)) {
      trunk_.emplace_back(k, k);
      continue;
    }
    if (bundled + work[k] > most) branches_.emplace_back(), bundled = 0;
    bundled += work[k];
    branches_.back().subtrees.emplace_back(first[k], k);
  }
}

/// A branch adds to its ancestors in places of its own in work_. They begin at `begin`; returns where they end.
std::size_t SingleFactor::send_elsewhere(Branch& branch, std::size_t begin) {
  std::vector<std::int32_t> place(new_to_old_.size(), -1);
  for (const auto& [first, last] : branch.subtrees) {
    const std::int32_t end = supernodes_[last].first_column + supernodes_[last].columns;
    const std::size_t rows_end = supernodes_[last].first_row + supernodes_[last].row_count;
    for (std::size_t r = supernodes_[first].first_row; r < rows_end; ++r) {
      const std::int32_t row = rows_[r];
      if (row < end) continue;
      if (place[row] < 0) {
        place[row] = static_cast<std::int32_t>(begin + branch.owed.size());
        branch.owed.push_back(row);
      }
      forward_rows_[r] = place[row];
    }
  }
  return begin + branch.owed.size();
}

void SingleFactor::finish() {
  forward_rows_ = rows_;
  cut_branches();
  std::size_t places = new_to_old_.size();
  for (Branch& branch : branches_) places = send_elsewhere(branch, places);
  work_ = std::vector<Row>(places);
}

/// x = L^-1 b for supernodes first to last, in work_.
void SingleFactor::solve_forward(std::size_t first, std::size_t last,
                                 const std::vector<std::int32_t>& rows) const {
  for (std::size_t k = first; k <= last; ++k) {
    const Supernode& node = supernodes_[k];
    Row* const own = work_.data() + node.first_column;
    const float* const triangle = values_.data() + node.first_value;
    solve_triangle(triangle, node.columns, own);
    add_below(triangle + node.columns * node.columns, node.columns, rows.data() + node.first_row,
              node.row_count, own, work_.data());
  }
}

/// x = L^-T b for supernodes last to first, in work_.
void SingleFactor::solve_backward(std::size_t first, std::size_t last) const {
  for (std::size_t k = last + 1; k-- > first;) {
    const Supernode& node = supernodes_[k];
    Row* const own = work_.data() + node.first_column;
    const float* const triangle = values_.data() + node.first_value;
    add_from_below(triangle + node.columns * node.columns, node.columns, rows_.data() + node.first_row,
                   node.row_count, own, work_.data());
    solve_transposed_triangle(triangle, node.columns, own);
  }
}

double SingleFactor::largest_entry(const Points& b, const Workers& workers) const {
  const std::size_t n = new_to_old_.size();
  chunk_maxima_.assign((n + kChunk - 1) / kChunk, 0);
  workers.for_chunks(n, kChunk, [&](std::size_t chunk, std::size_t begin, std::size_t end) {
    const auto rows = b.middleRows(static_cast<Eigen::Index>(begin), static_cast<Eigen::Index>(end - begin));
    chunk_maxima_[chunk] = rows.cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
  });
  double largest = 0;
  for (const double maximum : chunk_maxima_) {
    if (!(maximum <= largest) && !std::isnan(largest)) largest = maximum;
  }
  return largest;
}

template <typename Result>
void SingleFactor::solve_to(const Points& b, Result& x, const Workers& workers, double factor) const {
  using Number = typename Result::Scalar;
  // b is divided by its largest entry, so that no magnitude of b leaves the range of single precision.
  const double largest = largest_entry(b, workers), scale = 1 / largest;
  x.resize(b.rows(), 3);
  if (!std::isfinite(largest)) return void(x.setConstant(std::numeric_limits<Number>::quiet_NaN()));
  if (!std::isfinite(scale)) return void(x.setZero());
  const std::size_t n = new_to_old_.size();
  workers.for_chunks(n, kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const double* const row = b.data() + 3 * static_cast<std::size_t>(new_to_old_[i]);
      work_[i] = Row{static_cast<float>(scale * row[0]), static_cast<float>(scale * row[1]),
                     static_cast<float>(scale * row[2]), 0};
    }
  });
  std::fill(work_.begin() + static_cast<std::ptrdiff_t>(n), work_.end(), Row{});
  workers.for_chunks(branches_.size(), 1, [&](std::size_t k, std::size_t, std::size_t) {
    for (const auto& [first, last] : branches_[k].subtrees) solve_forward(first, last, forward_rows_);
  });
  std::size_t place = n;
  for (const Branch& branch : branches_) {
    for (const std::int32_t row : branch.owed) work_[row] += work_[place++];
  }
  for (const auto& [first, last] : trunk_) solve_forward(first, last, rows_);
  for (auto part = trunk_.rbegin(); part != trunk_.rend(); ++part) solve_backward(part->first, part->second);
  workers.for_chunks(branches_.size(), 1, [&](std::size_t k, std::size_t, std::size_t) {
    const auto& subtrees = branches_[k].subtrees;
    for (auto part = subtrees.rbegin(); part != subtrees.rend(); ++part)
      solve_backward(part->first, part->second);
  });
  const double back = factor * largest;
  workers.for_chunks(n, kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      Number* const row = x.data() + 3 * static_cast<std::size_t>(new_to_old_[i]);
      for (int c = 0; c < 3; ++c) row[c] = static_cast<Number>(back * static_cast<double>(work_[i][c]));
    }
  });
}

void SingleFactor::solve(const Points& b, Points& x, const Workers& workers, double factor) const {
  solve_to(b, x, workers, factor);
}

void SingleFactor::solve(const Points& b, SinglePoints& x, const Workers& workers, double factor) const {
  solve_to(b, x, workers, factor);
}

std::size_t SingleFactor::memory_bytes() const {
  return (new_to_old_.capacity() + 2 * rows_.capacity()) * sizeof(std::int32_t) +
         supernodes_.capacity() * sizeof(Supernode) + values_.capacity() * sizeof(float) +
         work_.capacity() * sizeof(Row);
}

}  // namespace lpdeform
