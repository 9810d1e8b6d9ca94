// The kernels of the single-precision factorisation compared with plain arithmetic, in every instruction set that this
// processor has.

#include "core/linalg/supernode_kernel.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/core/every_instruction_set.h"

namespace lpdeform {
namespace {

using Matrix = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

class SupernodeKernel : public EveryInstructionSet {
 protected:
};

TEST_P(SupernodeKernel, SubtractsProductsAtTheirPlaces) {
  for (const int columns : {1, 3, 8, 64}) {
    for (const int targets : {1, 7, 8, 9, 16, 17, 65}) {
      for (const int gap : {1, 2}) {  // columns side by side, or with one between
        const int row_count = targets + 5, width = gap * (targets - 1) + 3;
        const Matrix a = Matrix::Random(row_count, columns);
        std::vector<std::int32_t> rows, place(1000, -1);
        for (int r = 0; r < targets; ++r) rows.push_back(100 + 1 + gap * r);
        for (int r = targets; r < row_count; ++r) rows.push_back(500 + 2 * r);
        for (int r = 0; r < row_count; ++r) place[rows[r]] = 2 * r;
        Matrix block = Matrix::Random(2 * row_count, width), expected = block;
        const int begin = targets > 2 ? 2 : 0, end = row_count - 1;
        for (int r = begin; r < end; ++r) {
          for (int c = 0; c < targets; ++c) expected(2 * r, rows[c] - 100) -= a.row(r).dot(a.row(c));
        }
        std::vector<float> scratch;
        subtract_update({a.data(), rows.data(), static_cast<std::size_t>(columns)}, targets, begin, end,
                        place.data(), 100, block.data(), width, scratch);
        EXPECT_LT((block - expected).cwiseAbs().maxCoeff(), 1e-5f * columns)
            << columns << " " << targets << " " << gap;
      }
    }
  }
}

TEST_P(SupernodeKernel, FactorsTrianglesAndSolvesRowsBelow) {
  for (const int n : {1, 2, 7, 8, 9, 31, 64, 65}) {
    const Matrix half = Matrix::Random(n, n);
    const Matrix a = half * half.transpose() + 2.0f * static_cast<float>(n) * Matrix::Identity(n, n);
    const Eigen::MatrixXd l = a.cast<double>().llt().matrixL();
    Matrix triangle = a;
    const std::vector<float> lowest(n, 1e-6f);
    SolvingTriangle solving;
    ASSERT_TRUE(solving.factor(triangle.data(), n, lowest.data()));
    for (int r = 0; r < n; ++r) {
      EXPECT_NEAR(triangle(r, r), 1 / l(r, r), 1e-5 / l(r, r)) << n;
      for (int c = 0; c < r; ++c) EXPECT_NEAR(triangle(r, c), l(r, c), 1e-4) << n;
    }
    const Matrix x = Matrix::Random(6, n);
    Matrix rows = (l * x.cast<double>().transpose()).transpose().cast<float>();
    std::vector<float> scratch;
    solving.solve_rows(rows.data(), 6, scratch);
    EXPECT_LT((rows - x).cwiseAbs().maxCoeff(), 1e-4f) << n;
  }
}

TEST_P(SupernodeKernel, RefusesPivotsThatAreTooSmall) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  for (const float pivot : {1.0f, 0.0f, kNaN}) {  // 1 less what the first column takes leaves nothing
    std::vector<float> triangle = {1, 0, 1, pivot};
    const std::vector<float> lowest = {1e-6f, 1e-6f};
    EXPECT_FALSE(SolvingTriangle().factor(triangle.data(), 2, lowest.data())) << pivot;
  }
  std::vector<float> triangle = {1, 0, kNaN, 2};
  const std::vector<float> lowest = {1e-6f, 1e-6f};
  EXPECT_FALSE(SolvingTriangle().factor(triangle.data(), 2, lowest.data()));
}

TEST_P(SupernodeKernel, RaisesPivotsThatAreNearZeroIfThatIsWanted) {
  for (const float pivot : {1.0f, 1.0f - 5e-7f, 1.0f + 5e-7f}) {
    std::vector<float> triangle = {1, 0, 1, pivot};
    const std::vector<float> lowest = {1e-6f, 1e-6f};
    int raised = 3;
    EXPECT_TRUE(SolvingTriangle().factor(triangle.data(), 2, lowest.data(), &raised)) << pivot;
    EXPECT_EQ(raised, 4);
    EXPECT_FLOAT_EQ(triangle[3], 1e3f);  // 1 / sqrt(1e-6)
  }
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN(), kInfinite = HUGE_VALF;
  for (const auto& [pivot, least] : {std::pair{1.0f - 1e-5f, 1e-6f}, {kNaN, 1e-6f}, {kInfinite, kInfinite}}) {
    std::vector<float> triangle = {1, 0, 1, pivot};
    const std::vector<float> lowest = {1e-6f, least};
    int raised = 0;
    EXPECT_FALSE(SolvingTriangle().factor(triangle.data(), 2, lowest.data(), &raised)) << pivot;
  }
}

INSTANTIATE_TEST_SUITE_P(Targets, SupernodeKernel, testing::ValuesIn(instruction_sets()), by_its_name);

}  // namespace
}  // namespace lpdeform
