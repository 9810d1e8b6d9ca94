// The two substitutions with a factor compared with plain arithmetic, in every instruction set that this processor has.

#include "core/linalg/solve_kernel.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "tests/core/every_instruction_set.h"

namespace lpdeform {
namespace {

class SolveKernel : public EveryInstructionSet {
 protected:
};

/// Two supernodes of a factor L: the first has rows in the second and behind it, the second only behind it.
struct TwoSupernodes {
  TwoSupernodes(int columns, int below)
      : size(2 * columns + 2 * below), l(Eigen::MatrixXf::Zero(size, size)) {
    const Eigen::MatrixXf random = Eigen::MatrixXf::Random(size, 2 * columns);
    const auto add = [&](int first_column, const std::vector<int>& with_rows) {
      nodes.push_back({first_column, columns, rows.size(), with_rows.size(), values.size()});
      for (int r = 0; r < columns; ++r) {
        for (int c = 0; c < columns; ++c) {
          float entry = random(first_column + r, first_column + c);
          if (r == c) entry = 2 * static_cast<float>(columns) + entry;
          values.push_back(r == c  ? 1 / entry
                           : r > c ? entry
                                   : 1e30f);  // what is above the diagonal is not read
          if (r >= c) l(first_column + r, first_column + c) = entry;
        }
      }
      for (const int row : with_rows) {
        rows.push_back(row);
        for (int c = 0; c < columns; ++c) {
          values.push_back(random(row, first_column + c));
          l(row, first_column + c) = values.back();
        }
      }
    };
    l.diagonal().tail(2 * below).setOnes();
    std::vector<int> of_first, of_second;
    for (int k = 0; k < below; ++k) {
      of_second.push_back(2 * columns + 2 * k);
      of_first.push_back(k % 2 == 0 && k / 2 < columns ? columns + k / 2 : 2 * columns + 2 * k + 1);
    }
    add(0, of_first);
    add(columns, of_second);
  }
  int size;
  Eigen::MatrixXf l;
  std::vector<Supernode> nodes;
  std::vector<std::int32_t> rows;
  std::vector<float> values;
};

using Rows = Eigen::Matrix<float, Eigen::Dynamic, 4, Eigen::RowMajor>;

std::vector<SolveRow> packed(const Rows& from) {
  std::vector<SolveRow> result;
  for (Eigen::Index i = 0; i < from.rows(); ++i)
    result.push_back(SolveRow{from(i, 0), from(i, 1), from(i, 2), from(i, 3)});
  return result;
}

float difference(const std::vector<SolveRow>& found, const Eigen::MatrixXd& expected) {
  double result = 0;
  for (Eigen::Index i = 0; i < expected.rows(); ++i) {
    for (int axis = 0; axis < 4; ++axis)
      result = std::max(result, std::abs(static_cast<double>(found[static_cast<std::size_t>(i)][axis]) -
                                         expected(i, axis)));
  }
  return static_cast<float>(result);
}

TEST_P(SolveKernel, SolvesForwardAndBackward) {
  for (const int columns : {1, 2, 3, 4, 5, 7, 8, 13, 64}) {
    for (const int below : {0, 1, 3, 4, 7, 8, 9, 12, 21}) {
      const TwoSupernodes factor(columns, below);
      const Supernode* const first = factor.nodes.data();
      const Rows b = Rows::Random(factor.size, 4);
      const Eigen::MatrixXd l = factor.l.cast<double>(), right = b.cast<double>();

      // The rows behind both supernodes are not solved for, but have L's rows taken from them: there L is the identity.
      std::vector<SolveRow> work = packed(b);
      solve_forward(first, first + 2, factor.values.data(), factor.rows.data(), work.data());
      EXPECT_LT(difference(work, l.triangularView<Eigen::Lower>().solve(right)), 2e-5f)
          << columns << " " << below;

      work = packed(b);
      solve_backward(first, first + 2, factor.values.data(), factor.rows.data(), work.data());
      EXPECT_LT(difference(work, l.transpose().triangularView<Eigen::Upper>().solve(right)), 2e-5f)
          << columns << " " << below;
    }
  }
}

TEST_P(SolveKernel, LeavesOtherSupernodesAlone) {
  const TwoSupernodes factor(5, 6);
  const Rows b = Rows::Random(factor.size, 4);
  std::vector<SolveRow> work = packed(b), none = work;
  solve_forward(factor.nodes.data(), factor.nodes.data(), factor.values.data(), factor.rows.data(),
                none.data());
  EXPECT_EQ(difference(none, b.cast<double>()), 0);
  solve_backward(factor.nodes.data() + 1, factor.nodes.data() + 2, factor.values.data(), factor.rows.data(),
                 work.data());
  for (int i = 0; i < factor.size; ++i) {
    const bool is_in_second = i >= 5 && i < 10;
    for (int axis = 0; axis < 4; ++axis) {
      EXPECT_EQ(work[static_cast<std::size_t>(i)][axis] == b(i, axis), !is_in_second) << i;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, SolveKernel, testing::ValuesIn(instruction_sets()), by_its_name);

}  // namespace
}  // namespace lpdeform
