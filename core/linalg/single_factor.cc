#include "core/linalg/single_factor.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lpdeform {
namespace {

/// The largest subtree of each stage's branches, as a share of the whole tree. On surfaces the first stage alone leaves
/// 15 to 28 % of the factor for one thread, and all three leave 2 to 6 %.
constexpr double kStages[] = {1.0 / 16, 1.0 / 4, 0.6};
constexpr std::size_t kSmallestBranch = 1 << 14;  // entries; a smaller one is not worth a task
/// The least entries of a factor that has one stage, and of one that has all of them.
constexpr std::size_t kWorthOneStage = 4 * kSmallestBranch, kWorthAllStages = 64 * kSmallestBranch;
constexpr std::size_t kChunk = 4096;  // rows

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

std::size_t SingleFactor::value_count() const {
  if (supernodes_.empty()) return 0;
  const Supernode& last = supernodes_.back();
  const auto columns = static_cast<std::size_t>(last.columns);
  return last.first_value + columns * (columns + last.row_count);
}

/// Makes room for the values if they have been freed.
void SingleFactor::need_values() {
  if (values_.empty()) values_.resize(value_count());
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

/// Cuts the tree where the subtrees become small enough for each stage, and groups what is new in them into branches.
void SingleFactor::cut_stages() {
  stages_.clear();
  const auto count = static_cast<std::int32_t>(supernodes_.size());
  const std::vector<std::int32_t> parent = parents();
  std::vector<std::size_t> entries(count), work(count);  // of each supernode, of the subtree below it
  for (std::int32_t k = 0; k < count; ++k) {
    const Supernode& node = supernodes_[k];
    entries[k] =
        static_cast<std::size_t>(node.columns) * (static_cast<std::size_t>(node.columns) + node.row_count);
    work[k] += entries[k];
    if (parent[k] >= 0) work[parent[k]] += work[k];
  }
  std::vector<char> is_placed(count, false);
  const auto append = [](std::vector<Range>& to, std::int32_t k) {
    if (!to.empty() && to.back().second == k - 1)
      ++to.back().second;
    else
      to.emplace_back(k, k);
  };
  const auto unplaced = [&] {
    std::vector<Range> result;
    for (std::int32_t k = 0; k < count; ++k) {
      if (!is_placed[k]) append(result, k);
    }
    return result;
  };
  for (const double share : kStages) {
    if (values_.size() < (stages_.empty() ? kWorthOneStage : kWorthAllStages)) break;
    const auto most =
        std::max(static_cast<std::size_t>(share * static_cast<double>(values_.size())), kSmallestBranch);
    // Of each supernode: the root of the largest subtree that is small enough, and what is new in this subtree.
    std::vector<std::int32_t> root(count, -1), branch(count);
    std::vector<std::size_t> new_entries(count);
    for (std::int32_t k = count; k-- > 0;) {
      if (is_placed[k] || work[k] > most) continue;
      root[k] = parent[k] >= 0 && root[parent[k]] >= 0 ? root[parent[k]] : k;
      new_entries[root[k]] += entries[k];
    }
    const std::size_t fullest = stages_.empty() ? most : kSmallestBranch;
    std::size_t bundled = fullest;
    Stage& stage = stages_.emplace_back();
    for (std::int32_t k = 0; k < count; ++k) {
      if (root[k] != k) continue;
      if (bundled + new_entries[k] > fullest) stage.emplace_back(), bundled = 0;
      bundled += new_entries[k];
      branch[k] = static_cast<std::int32_t>(stage.size()) - 1;
    }
    for (std::int32_t k = 0; k < count; ++k) {
      if (root[k] < 0) continue;
      append(stage[branch[root[k]]].nodes, k);
      is_placed[k] = true;
    }
    if (stages_.size() == 1) trunk_ = unplaced();
  }
  top_ = unplaced();
  if (stages_.empty()) trunk_ = top_;
}

/// A branch adds to rows that are not its own in places of its own in work_. They begin at `begin`; returns where they
/// end.
std::size_t SingleFactor::send_elsewhere(Branch& branch, std::size_t begin) {
  std::vector<std::int32_t> place(new_to_old_.size(), -1);
  for (const auto& [first, last] : branch.nodes) {
    const std::int32_t end = supernodes_[last].first_column + supernodes_[last].columns;
    for (std::int32_t c = supernodes_[first].first_column; c < end; ++c) place[c] = c;
  }
  for (const auto& [first, last] : branch.nodes) {
    const std::size_t rows_end = supernodes_[last].first_row + supernodes_[last].row_count;
    for (std::size_t r = supernodes_[first].first_row; r < rows_end; ++r) {
      const std::int32_t row = rows_[r];
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
  cut_stages();
  std::size_t places = new_to_old_.size();
  for (Stage& stage : stages_) {
    for (Branch& branch : stage) places = send_elsewhere(branch, places);
  }
  work_ = std::vector<SolveRow>(places);
}

/// x = L^-1 b for supernodes first to last, in work_.
void SingleFactor::solve_forward(std::int32_t first, std::int32_t last) const {
  lpdeform::solve_forward(supernodes_.data() + first, supernodes_.data() + last + 1, values_.data(),
                          forward_rows_.data(), work_.data());
}

/// x = L^-T b for supernodes last to first, in work_.
void SingleFactor::solve_backward(std::int32_t first, std::int32_t last) const {
  lpdeform::solve_backward(supernodes_.data() + first, supernodes_.data() + last + 1, values_.data(),
                           rows_.data(), work_.data());
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
      work_[i] = SolveRow{static_cast<float>(scale * row[0]), static_cast<float>(scale * row[1]),
                          static_cast<float>(scale * row[2]), 0};
    }
  });
  std::fill(work_.begin() + static_cast<std::ptrdiff_t>(n), work_.end(), SolveRow{});
  std::size_t place = n;
  for (const Stage& stage : stages_) {
    workers.for_chunks(stage.size(), 1, [&](std::size_t k, std::size_t, std::size_t) {
      for (const auto& [first, last] : stage[k].nodes) solve_forward(first, last);
    });
    for (const Branch& branch : stage) {
      for (const std::int32_t row : branch.owed) work_[row] += work_[place++];
    }
  }
  for (const auto& [first, last] : top_) solve_forward(first, last);
  for (auto part = top_.rbegin(); part != top_.rend(); ++part) solve_backward(part->first, part->second);
  for (auto stage = stages_.rbegin(); stage != stages_.rend(); ++stage) {
    workers.for_chunks(stage->size(), 1, [&](std::size_t k, std::size_t, std::size_t) {
      const std::vector<Range>& nodes = (*stage)[k].nodes;
      for (auto part = nodes.rbegin(); part != nodes.rend(); ++part)
        solve_backward(part->first, part->second);
    });
  }
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
         work_.capacity() * sizeof(SolveRow);
}

}  // namespace lpdeform
