#include "core/linalg/cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>
#include <map>
#include <random>

namespace lpdeform {
namespace {

/// A dense positive definite matrix with a band of `width`, and its lower triangle.
Eigen::MatrixXd banded(int n, int width) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> value(-1, 1);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = std::max(0, i - width); j < i; ++j) a(i, j) = a(j, i) = value(random);
    a(i, i) = 2 * width + 1;
  }
  return a;
}

LowerMatrix lower(const Eigen::MatrixXd& a) {
  LowerMatrix result;
  result.columns.push_back(0);
  for (int column = 0; column < a.cols(); ++column) {
    for (int row = column; row < a.rows(); ++row) {
      if (row != column && a(row, column) == 0) continue;
      result.rows.push_back(row);
      result.values.push_back(a(row, column));
    }
    result.columns.push_back(static_cast<std::int32_t>(result.rows.size()));
  }
  return result;
}

TEST(Cholesky, SolvesForOneAndThreeRightHandSides) {
  const Eigen::MatrixXd a = banded(60, 4);
  SparseCholesky cholesky(lower(a));
  ASSERT_TRUE(cholesky.factor(lower(a)));
  const Points expected = Points::Random(60, 3);
  Points x;
  cholesky.solve(Points(a * expected), x);
  EXPECT_LT((x - expected).norm(), 1e-12);
  Eigen::VectorXd one;
  cholesky.solve(Eigen::VectorXd(a * expected.col(1)), one);
  EXPECT_LT((one - expected.col(1)).norm(), 1e-12);
}

// Few entries a column are factored column by column, many in supernodes.
class SinglePrecision : public testing::TestWithParam<std::pair<int, int>> {};

TEST_P(SinglePrecision, SolvesToSevenDigitsWhateverTheScale) {
  const auto [size, width] = GetParam();
  const Eigen::MatrixXd a = banded(size, width);
  SparseCholesky cholesky(lower(a));
  ASSERT_TRUE(cholesky.factor(lower(a)));
  SingleFactor single;
  EXPECT_TRUE(single.empty());
  cholesky.copy_to(single);
  EXPECT_FALSE(single.empty());
  const Points expected = Points::Random(size, 3);
  for (const double scale : {1.0, 1e-300, 1e300}) {
    Points x = scale * (a * expected);
    single.solve(x, x, Workers(1));
    // The matrix is diagonally dominant: its condition is below 10.
    EXPECT_LT((x / scale - expected).cwiseAbs().maxCoeff(), 1e-5);
  }
  Points zero = Points::Zero(size, 3);
  single.solve(zero, zero, Workers(1));
  EXPECT_EQ(zero, Points::Zero(size, 3));
}

INSTANTIATE_TEST_SUITE_P(Patterns, SinglePrecision,
                         testing::Values(std::pair{1, 1}, std::pair{60, 1}, std::pair{200, 4},
                                         std::pair{400, 100}));

TEST(Cholesky, ASinglePrecisionCopyCanBeMadeAgain) {
  SingleFactor single;
  Points x;
  for (const int width : {4, 7}) {
    const Eigen::MatrixXd a = banded(80, width);
    SparseCholesky cholesky(lower(a));
    ASSERT_TRUE(cholesky.factor(lower(a)));
    cholesky.copy_to(single);
    const Points expected = Points::Random(80, 3);
    single.solve(Points(a * expected), x, Workers(1));
    EXPECT_LT((x - expected).cwiseAbs().maxCoeff(), 1e-5);
  }
}

LowerMatrix with_shortcuts(const LowerMatrix& matrix, int count) {
  std::mt19937 random(9);
  std::uniform_int_distribution<int> point(0, matrix.size() - 1);
  std::vector<std::map<int, double>> columns(static_cast<std::size_t>(matrix.size()));
  for (std::int32_t c = 0; c < matrix.size(); ++c) {
    for (std::int32_t k = matrix.columns[c]; k < matrix.columns[c + 1]; ++k) {
      columns[static_cast<std::size_t>(c)][matrix.rows[k]] = matrix.values[k];
    }
  }
  for (int k = 0; k < count; ++k) {
    const int a = point(random), b = point(random);
    if (a == b || columns[static_cast<std::size_t>(std::min(a, b))].contains(std::max(a, b))) continue;
    columns[static_cast<std::size_t>(std::min(a, b))][std::max(a, b)] = -1;
    columns[static_cast<std::size_t>(a)][a] += 1;
    columns[static_cast<std::size_t>(b)][b] += 1;
  }
  LowerMatrix result;
  result.columns.push_back(0);
  for (const auto& column : columns) {
    for (const auto& [row, value] : column) result.rows.push_back(row), result.values.push_back(value);
    result.columns.push_back(static_cast<std::int32_t>(result.rows.size()));
  }
  return result;
}

/// The five-point Laplacian of a square, plus the identity: a tree with many branches. With `shortcuts` as many
/// pairs of points are joined besides: a tree whose subtrees do not all lie together.
LowerMatrix square_laplacian(int side, int shortcuts = 0) {
  if (shortcuts > 0) return with_shortcuts(square_laplacian(side), shortcuts);
  LowerMatrix result;
  result.columns.push_back(0);
  const auto add = [&](int row, double value) { result.rows.push_back(row), result.values.push_back(value); };
  for (int i = 0; i < side * side; ++i) {
    add(i, 5);
    if ((i + 1) % side != 0) add(i + 1, -1);
    if (i + side < side * side) add(i + side, -1);
    result.columns.push_back(static_cast<std::int32_t>(result.rows.size()));
  }
  return result;
}

TEST(SingleFactor, GivesTheSameBitsOnAnyNumberOfThreadsAndTheRightOnes) {
  for (const auto& [side, shortcuts] : {std::pair{60, 0}, {150, 0}, {220, 300}, {220, 500}, {260, 700}}) {
    const LowerMatrix matrix = square_laplacian(side, shortcuts);
    SparseCholesky cholesky(matrix);
    ASSERT_TRUE(cholesky.factor(matrix));
    SingleFactor single;
    cholesky.copy_to(single);
    const Points b = Points::Random(side * side, 3);
    Points expected, one, several;
    cholesky.solve(b, expected);
    single.solve(b, one, Workers(1));
    EXPECT_LT((one - expected).cwiseAbs().maxCoeff(), 1e-5);
    for (const int threads : {2, 4}) {
      single.solve(b, several, Workers(threads));
      EXPECT_EQ(several, one);
    }
  }
}

TEST(Cholesky, SolvesInPlace) {
  const Eigen::MatrixXd a = banded(30, 2);
  SparseCholesky cholesky(lower(a));
  ASSERT_TRUE(cholesky.factor(lower(a)));
  const Points expected = Points::Random(30, 3);
  Points x = a * expected;
  cholesky.solve(x, x);
  EXPECT_LT((x - expected).norm(), 1e-12);
}

TEST(Cholesky, FactorsAgainOnTheSamePattern) {
  const Eigen::MatrixXd a = banded(40, 3);
  SparseCholesky cholesky(lower(a));
  for (const double scale : {1.0, 7.0, 1e-6}) {
    ASSERT_TRUE(cholesky.factor(lower(scale * a)));
    const Points expected = Points::Random(40, 3);
    Points x;
    cholesky.solve(Points(scale * a * expected), x);
    EXPECT_LT((x - expected).norm(), 1e-11);
  }
}

TEST(Cholesky, RefusesWhatIsNotPositiveDefinite) {
  Eigen::MatrixXd a = banded(20, 2);
  SparseCholesky cholesky(lower(a));
  Eigen::MatrixXd indefinite = a;
  indefinite(10, 10) = -5;
  EXPECT_FALSE(cholesky.factor(lower(indefinite)));
  Eigen::MatrixXd not_finite = a;
  not_finite(3, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(cholesky.factor(lower(not_finite)));
  EXPECT_TRUE(cholesky.factor(lower(a)));  // and recovers
}

TEST(Cholesky, CountsItsMemory) {
  const Eigen::MatrixXd a = banded(200, 4);
  SparseCholesky cholesky(lower(a));
  ASSERT_TRUE(cholesky.factor(lower(a)));
  EXPECT_GT(cholesky.memory_bytes(), 200u * 5 * sizeof(double));
}

}  // namespace
}  // namespace lpdeform
