#include "client/cli/reproduce/least_absolute.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lpdeform::reproduce {
namespace {

using Eigen::MatrixXd, Eigen::VectorXd;

TEST(LeastAbsolute, FindsTheMedian) {
  // |x - 1| + |x - 2| + |x - 4| + |x - 9| + |x - 100| is least at the median, 4.
  const MatrixXd a = MatrixXd::Ones(5, 1);
  const VectorXd b{{-1, -2, -4, -9, -100}};
  const LeastAbsolute least = least_absolute(a, b);
  EXPECT_EQ(least.rank, 1);
  EXPECT_EQ(non_zeros(least.u), 4);
  EXPECT_NEAR(least.u.lpNorm<1>(), 3 + 2 + 0 + 5 + 96, 1e-9);
  EXPECT_NEAR(least.lower_bound, 106, 1e-6);
}

TEST(LeastAbsolute, IgnoresAnOutlierThatTheRestContradicts) {
  // A line through four of five points: their residuals vanish, the fifth's is its distance.
  MatrixXd a(5, 2);
  a << 1, 0, 1, 1, 1, 2, 1, 3, 1, 4;
  const VectorXd b{{-1, -3, -5, -27, -9}};  // y = 1 + 2 x, but 20 more at x = 3
  const LeastAbsolute least = least_absolute(a, b);
  EXPECT_NEAR(least.u.lpNorm<1>(), 20, 1e-9);
  EXPECT_NEAR(std::abs(least.u[3]), 20, 1e-9);
  EXPECT_EQ(non_zeros(least.u), 1);
}

TEST(LeastAbsolute, ClosesItsDualityGapOnGeneratedProblems) {
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  const auto entry = [&] { return normal(random); };
  for (const int rank : {1, 5, 12}) {
    const MatrixXd a = MatrixXd::NullaryExpr(50, rank, entry) * MatrixXd::NullaryExpr(rank, 15, entry);
    const LeastAbsolute least = least_absolute(a, VectorXd::NullaryExpr(50, entry));
    const double value = least.u.lpNorm<1>();
    EXPECT_EQ(least.rank, rank);
    EXPECT_LE(least.lower_bound, value * (1 + 1e-12));
    EXPECT_GE(least.lower_bound, value * (1 - 1e-6));
    EXPECT_EQ(non_zeros(least.u), 50 - rank);
  }
}

TEST(LeastAbsolute, IsZeroForNothing) {
  EXPECT_EQ(least_absolute(MatrixXd::Ones(3, 1), VectorXd::Zero(3)).u.norm(), 0);
}

TEST(NonZeros, AreCountedRelativeToTheLargest) {
  EXPECT_EQ(non_zeros(VectorXd{{1e9, -1e4, 10, 0}}), 2);
}

}  // namespace
}  // namespace lpdeform::reproduce
