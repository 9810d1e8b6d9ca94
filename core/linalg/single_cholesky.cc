#include "core/linalg/single_cholesky.h"

#include <algorithm>
#include <atomic>

#include "core/base/check.h"

namespace lpdeform {
namespace {

constexpr std::int32_t kWidest = 64;     // most columns of a supernode; wider ones are split
constexpr float kLowestPivot = 1e-6f;    // relative to the matrix's diagonal entry
constexpr std::size_t kTile = 64;        // rows of a supernode that one task computes
constexpr double kWorthTasks = 200'000;  // multiplications from which on separate tasks pay off

}  // namespace

std::size_t entry_count(const SupernodePattern& supernodes) {
  std::size_t result = 0;
  for (std::size_t k = 0; k + 1 < supernodes.first_columns.size(); ++k) {
    const auto columns =
        static_cast<std::size_t>(supernodes.first_columns[k + 1] - supernodes.first_columns[k]);
    result += columns * (columns + supernodes.first_rows[k + 1] - supernodes.first_rows[k]);
  }
  return result;
}

double operation_count(const SupernodePattern& supernodes) {
  double result = 0;
  for (std::size_t k = 0; k + 1 < supernodes.first_columns.size(); ++k) {
    const double columns = supernodes.first_columns[k + 1] - supernodes.first_columns[k];
    const auto below = static_cast<double>(supernodes.first_rows[k + 1] - supernodes.first_rows[k]);
    // sum_{j = 1}^columns (below + j)^2
    result += columns * (below * below + below * (columns + 1) + (columns + 1) * (2 * columns + 1) / 6);
  }
  return result;
}

SingleCholesky::SingleCholesky(const SupernodePattern& supernodes) {
  const std::size_t n = supernodes.new_to_old.size();
  old_to_new_.resize(n);
  for (std::size_t i = 0; i < n; ++i) old_to_new_[supernodes.new_to_old[i]] = static_cast<std::int32_t>(i);
  factor_.begin(supernodes.new_to_old.data(), n, entry_count(supernodes));
  std::vector<std::int32_t> rows;
  for (std::size_t k = 0; k + 1 < supernodes.first_columns.size(); ++k) {
    const std::int32_t end = supernodes.first_columns[k + 1];
    for (std::int32_t column = supernodes.first_columns[k]; column < end;) {
      const std::int32_t columns = std::min(kWidest, end - column);
      rows.clear();
      for (std::int32_t row = column + columns; row < end; ++row) rows.push_back(row);
      rows.insert(rows.end(), supernodes.rows.begin() + static_cast<std::ptrdiff_t>(supernodes.first_rows[k]),
                  supernodes.rows.begin() + static_cast<std::ptrdiff_t>(supernodes.first_rows[k + 1]));
      factor_.new_supernode(columns, rows.data(), rows.size());
      column += columns;
    }
  }
  factor_.finish();
  find_updates();
}

/// Finds which supernodes update which; ascending for each.
void SingleCholesky::find_updates() {
  const std::size_t count = factor_.supernodes_.size();
  const std::vector<std::int32_t> node_of = factor_.node_of_columns();
  first_update_.assign(count + 1, 0);
  update_work_.assign(count, 0);
  const auto for_updates = [&](const auto& body) {
    for (std::size_t k = 0; k < count; ++k) {
      const Supernode& node = factor_.supernodes_[k];
      const std::int32_t* const rows = factor_.rows_.data() + node.first_row;
      for (std::size_t begin = 0, end = 0; begin < node.row_count; begin = end) {
        const std::int32_t target = node_of[rows[begin]];
        while (end < node.row_count && node_of[rows[end]] == target) ++end;
        body(k, target, begin, end);
      }
    }
  };
  for_updates([&](std::size_t k, std::int32_t target, std::size_t begin, std::size_t end) {
    ++first_update_[target + 1];
    const Supernode& node = factor_.supernodes_[k];
    update_work_[target] += static_cast<double>(node.columns) * static_cast<double>(end - begin) *
                            static_cast<double>(node.row_count - begin);
  });
  for (std::size_t k = 0; k < count; ++k) first_update_[k + 1] += first_update_[k];
  updates_.resize(first_update_[count]);
  std::vector<std::size_t> next(first_update_.begin(), first_update_.end() - 1);
  for_updates([&](std::size_t k, std::int32_t target, std::size_t begin, std::size_t end) {
    updates_[next[target]++] = {static_cast<std::int32_t>(k), static_cast<std::int32_t>(begin),
                                static_cast<std::int32_t>(end - begin)};
  });
}

SingleCholesky::Scratch& SingleCholesky::scratch_of_thread() {
  static thread_local Scratch result;
  return result;
}

/// Loads the matrix's entries into the block, and fills the table of places in the block.
void SingleCholesky::load(std::size_t node, const SymmetricRows& matrix, Scratch& own) {
  const Supernode& at = factor_.supernodes_[node];
  const auto columns = static_cast<std::size_t>(at.columns);
  float* const block = factor_.values_.data() + at.first_value;
  std::fill_n(block, columns * (columns + at.row_count), 0.0f);
  if (own.place.size() < old_to_new_.size()) own.place.resize(old_to_new_.size());
  for (std::size_t c = 0; c < columns; ++c) own.place[at.first_column + c] = static_cast<std::int32_t>(c);
  const std::int32_t* const rows = factor_.rows_.data() + at.first_row;
  for (std::size_t r = 0; r < at.row_count; ++r) own.place[rows[r]] = static_cast<std::int32_t>(columns + r);

  for (std::size_t c = 0; c < columns; ++c) {
    const std::int32_t column = at.first_column + static_cast<std::int32_t>(c);
    own.row.clear();
    matrix.append_row(factor_.new_to_old()[column], own.row);
    for (const SymmetricRows::Entry& entry : own.row) {
      const std::int32_t row = old_to_new_[entry.column];
      if (row < column) continue;
      const auto r = static_cast<std::size_t>(own.place[row]);
      LPDEFORM_CHECK(r < columns + at.row_count);  // place may have it from another supernode
      LPDEFORM_CHECK(row == (r < columns ? at.first_column + own.place[row] : rows[r - columns]));
      block[r * columns + c] = static_cast<float>(entry.value);
    }
  }
  if (own.lowest.size() < columns) own.lowest.resize(columns);
  for (std::size_t c = 0; c < columns; ++c) own.lowest[c] = kLowestPivot * block[c * columns + c];
}

/// Subtracts the updates by previously eliminated supernodes from rows begin to end - 1 of a supernode.
void SingleCholesky::update_rows(std::size_t node, std::size_t begin, std::size_t end,
                                 const std::vector<std::int32_t>& place) {
  const Supernode& at = factor_.supernodes_[node];
  const bool is_whole = begin == 0 && end == static_cast<std::size_t>(at.columns) + at.row_count;
  std::vector<float>& packed = scratch_of_thread().packed;
  for (std::size_t u = first_update_[node]; u < first_update_[node + 1]; ++u) {
    const Update& update = updates_[u];
    const Supernode& from = factor_.supernodes_[update.from];
    const auto columns = static_cast<std::size_t>(from.columns);
    const std::size_t skipped = static_cast<std::size_t>(update.begin);
    const std::int32_t* const rows = factor_.rows_.data() + from.first_row + skipped;
    std::size_t first = 0, last = from.row_count - skipped;
    if (!is_whole) {
      const auto is_before = [&](std::int32_t row, std::size_t limit) {
        return static_cast<std::size_t>(place[row]) < limit;
      };
      first = static_cast<std::size_t>(std::lower_bound(rows, rows + last, begin, is_before) - rows);
      last = static_cast<std::size_t>(std::lower_bound(rows + first, rows + last, end, is_before) - rows);
    }
    if (first == last) continue;
    const EliminatedRows eliminated{factor_.values_.data() + from.first_value + (columns + skipped) * columns,
                                    rows, columns};
    subtract_update(eliminated, static_cast<std::size_t>(update.count), first, last, place.data(),
                    at.first_column, factor_.values_.data() + at.first_value,
                    static_cast<std::size_t>(at.columns), packed);
  }
}

bool SingleCholesky::eliminate(std::size_t node, const SymmetricRows& matrix, const Workers& workers,
                               std::atomic<int>& raisable, Scratch& own) {
  const Supernode& at = factor_.supernodes_[node];
  const auto columns = static_cast<std::size_t>(at.columns);
  load(node, matrix, own);
  const std::size_t rows = columns + at.row_count;
  const double solve_work =
      static_cast<double>(columns) * static_cast<double>(columns) * static_cast<double>(at.row_count) / 2;
  const bool is_shared = workers.threads() > 1 && update_work_[node] + solve_work > kWorthTasks;
  const auto for_rows = [&](std::size_t count, const auto& body) {
    if (!is_shared) return body(0, 0, count);
    workers.for_chunks(count, kTile, body);
  };
  for_rows(rows, [&](std::size_t, std::size_t begin, std::size_t end) {
    update_rows(node, begin, end, own.place);
  });
  float* const block = factor_.values_.data() + at.first_value;
  int raised = 0;
  if (!own.triangle.factor(block, columns, own.lowest.data(), raisable > 0 ? &raised : nullptr)) return false;
  if (raised > 0 && (raisable -= raised) < 0) return false;
  if (at.row_count == 0) return true;
  for_rows(at.row_count, [&](std::size_t, std::size_t begin, std::size_t end) {
    own.triangle.solve_rows(block + (columns + begin) * columns, end - begin, scratch_of_thread().packed);
  });
  return true;
}

bool SingleCholesky::factor(const SymmetricRows& matrix, const Workers& workers, int most_raised) {
  std::atomic<bool> is_good = true;
  std::atomic<int> raisable = most_raised;
  const Workers alone(1);
  factor_.need_values();
  if (!factor_.stages_.empty()) {
    const SingleFactor::Stage& branches = factor_.stages_.front();
    workers.for_chunks(branches.size(), 1, [&](std::size_t k, std::size_t, std::size_t) {
      for (const auto& [first, last] : branches[k].nodes) {
        for (std::int32_t node = first; node <= last && is_good; ++node) {
          if (!eliminate(static_cast<std::size_t>(node), matrix, alone, raisable, scratch_of_thread()))
            is_good = false;
        }
      }
    });
  }
  for (const auto& [first, last] : factor_.trunk_) {
    for (std::int32_t node = first; node <= last && is_good; ++node)
      is_good = eliminate(static_cast<std::size_t>(node), matrix, workers, raisable, trunk_);
  }
  return is_good;
}

std::size_t SingleCholesky::memory_bytes() const {
  return factor_.memory_bytes() + old_to_new_.capacity() * sizeof(std::int32_t) +
         updates_.capacity() * sizeof(Update) + update_work_.capacity() * sizeof(double) +
         first_update_.capacity() * sizeof(std::size_t);
}

}  // namespace lpdeform
