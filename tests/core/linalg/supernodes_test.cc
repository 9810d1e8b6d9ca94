#include "core/linalg/supernodes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <set>
#include <vector>

#include "tests/core/linalg/matrices.h"

namespace lpdeform {
namespace {

using Rows = std::vector<std::set<std::int32_t>>;

/// The rows of each column of the factor, by elimination of one column after the other.
Rows eliminated(const LowerMatrix& pattern, const std::vector<std::int32_t>& new_to_old) {
  std::vector<std::int32_t> old_to_new(new_to_old.size());
  for (std::size_t i = 0; i < new_to_old.size(); ++i)
    old_to_new[new_to_old[i]] = static_cast<std::int32_t>(i);
  Rows rows(new_to_old.size());
  for (std::int32_t j = 0; j < pattern.size(); ++j) {
    for (std::int32_t e = pattern.columns[j]; e < pattern.columns[j + 1]; ++e) {
      const std::int32_t a = old_to_new[j], b = old_to_new[pattern.rows[e]];
      rows[std::min(a, b)].insert(std::max(a, b));
    }
  }
  for (const auto& column : rows) {
    for (auto a = std::next(column.begin()); a != column.end(); ++a) rows[*a].insert(a, column.end());
  }
  return rows;
}

std::vector<LowerMatrix> matrices() {
  std::vector<LowerMatrix> result{lower(Eigen::MatrixXd::Identity(5, 5)), lower(banded(1, 1)),
                                  lower(banded(60, 1)), lower(banded(150, 149))};
  result.push_back(square_laplacian(30));
  result.push_back(square_laplacian(25, 60));
  return result;
}

TEST(EliminationTree, CountsTheEntriesOfEachColumnOfTheFactor) {
  for (const LowerMatrix& matrix : matrices()) {
    const EliminationTree tree = eliminate(matrix);
    const Rows rows = eliminated(matrix, tree.new_to_old);
    for (std::size_t j = 0; j < rows.size(); ++j) {
      ASSERT_EQ(tree.counts[j], static_cast<std::int32_t>(rows[j].size()));
      ASSERT_EQ(tree.parents[j], rows[j].size() > 1 ? *std::next(rows[j].begin()) : -1);
    }
  }
}

TEST(EliminationTree, HasEachColumnOnceAndItsDescendantsDirectlyBeforeIt) {
  for (const LowerMatrix& matrix : matrices()) {
    const EliminationTree tree = eliminate(matrix);
    std::vector<std::int32_t> order = tree.new_to_old, size(order.size(), 1);
    for (std::size_t j = 0; j < order.size(); ++j) {
      const std::int32_t parent = tree.parents[j];
      if (parent == -1) continue;
      size[parent] += size[j];
    }
    for (std::size_t j = 0; j < order.size(); ++j) {
      const std::int32_t parent = tree.parents[j];
      if (parent == -1) continue;
      EXPECT_GT(static_cast<std::int32_t>(j), parent - size[parent]);
    }
    std::sort(order.begin(), order.end());
    for (std::size_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], static_cast<std::int32_t>(i));
  }
}

TEST(SupernodePattern, HoldsEveryEntryOfTheFactorAndFewZeros) {
  for (const LowerMatrix& matrix : matrices()) {
    const SupernodePattern pattern = analyse_supernodes(matrix).value();
    const Rows rows = eliminated(matrix, pattern.new_to_old);
    std::size_t entries = 0;
    for (std::size_t k = 0; k + 1 < pattern.first_columns.size(); ++k) {
      const auto begin = pattern.rows.begin() + static_cast<std::ptrdiff_t>(pattern.first_rows[k]);
      const auto end = pattern.rows.begin() + static_cast<std::ptrdiff_t>(pattern.first_rows[k + 1]);
      EXPECT_TRUE(std::is_sorted(begin, end));
      EXPECT_EQ(std::adjacent_find(begin, end), end);
      for (std::int32_t j = pattern.first_columns[k]; j < pattern.first_columns[k + 1]; ++j) {
        entries += rows[j].size();
        for (const std::int32_t row : rows[j]) {
          const bool is_in_triangle = row < pattern.first_columns[k + 1];
          EXPECT_TRUE(is_in_triangle || std::binary_search(begin, end, row));
        }
      }
    }
    // At most four fifths of a triangle are zeros, and entry_count() counts a square in place of a triangle.
    EXPECT_LE(entry_count(pattern), 10 * entries);
  }
}

}  // namespace
}  // namespace lpdeform
