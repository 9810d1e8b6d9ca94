#include "core/linalg/cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>

#include "tests/core/linalg/matrices.h"

namespace lpdeform {
namespace {

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

TEST(SingleFactor, TakesLargeAndSmallCopiesInTurn) {
  SingleFactor single;
  for (const int side : {220, 20, 110, 220}) {  // with three stages of branches, with none and with one
    const LowerMatrix matrix = square_laplacian(side);
    SparseCholesky cholesky(matrix);
    ASSERT_TRUE(cholesky.factor(matrix));
    cholesky.copy_to(single);
    const Points b = Points::Random(side * side, 3);
    Points expected, x;
    cholesky.solve(b, expected);
    single.solve(b, x, Workers(2));
    EXPECT_LT((x - expected).cwiseAbs().maxCoeff(), 1e-5) << side;
  }
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
