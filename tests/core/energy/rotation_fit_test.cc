#include "core/energy/rotation_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

namespace lpdeform {
namespace {

using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

void expect_rotation(const Matrix3d& r) {
  EXPECT_LT((r * r.transpose() - Matrix3d::Identity()).norm(), 1e-14);
  EXPECT_NEAR(r.determinant(), 1, 1e-14);
}

Matrix3d random_matrix(std::mt19937& random) {
  std::normal_distribution<double> normal;
  return Matrix3d::NullaryExpr([&] { return normal(random); });
}

double value(const Matrix3d& r, const Matrix3d& b) {
  return r.cwiseProduct(b).sum();
}

TEST(RotationFit, AgreesWithTheSvdOnRandomMatrices) {
  std::mt19937 random(1);
  for (int trial = 0; trial < 20000; ++trial) {
    const Matrix3d b = random_matrix(random);  // half of them have det < 0
    const Matrix3d r = fit_rotation(b);
    expect_rotation(r);
    EXPECT_NEAR(value(r, b), value(fit_rotation_svd(b), b), 1e-13 * b.norm());
  }
}

TEST(RotationFit, RecoversARotationToRoundingAlsoNearHalfTurns) {
  std::mt19937 random(2);
  for (const double angle :
       {0.0, 1e-9, 0.3, std::numbers::pi / 2, std::numbers::pi - 1e-9, std::numbers::pi}) {
    for (const Vector3d& axis :
         {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0, 0, 1), Vector3d(1, 2, -3)}) {
      const Matrix3d expected = AngleAxisd(angle, axis.normalized()).toRotationMatrix();
      Matrix3d spread = random_matrix(random);
      spread = spread * spread.transpose();  // positive definite: the fit of expected * spread is expected
      EXPECT_LT((fit_rotation(expected * spread) - expected).norm(), 1e-11);
      EXPECT_LT((fit_rotation(expected) - expected).norm(), 4e-15);
    }
  }
}

TEST(RotationFit, IsExactForFlatCells) {
  const Matrix3d expected = AngleAxisd(1.1, Vector3d(1, 1, 2).normalized()).toRotationMatrix();
  const Matrix3d flat = Vector3d(2, 3, 0).asDiagonal();  // rank 2: a planar one-ring
  EXPECT_LT((fit_rotation(expected * flat) - expected).norm(), 1e-14);
}

TEST(RotationFit, DoesNotDependOnScale) {
  std::mt19937 random(3);
  const Matrix3d b = random_matrix(random);
  for (const double scale : {1e-200, 1e-12, 1e12, 1e200}) {
    EXPECT_LT((fit_rotation(scale * b) - fit_rotation(b)).norm(), 1e-14);
  }
}

TEST(RotationFit, IsARotationAtRankOne) {
  for (const Vector3d& a : {Vector3d(1, 0, 0), Vector3d(-1, 2, 5)}) {
    const Vector3d b(0.3, -1, 2);
    const Matrix3d rank_one = b * a.transpose();
    const Matrix3d r = fit_rotation(rank_one);
    expect_rotation(r);
    EXPECT_NEAR(value(r, rank_one), a.norm() * b.norm(), 1e-13);  // a is turned onto b: the most there is
  }
}

TEST(RotationFit, IsTheIdentityAtRankZero) {
  EXPECT_EQ(fit_rotation(Matrix3d::Zero()), Matrix3d::Identity());
}

TEST(RotationFit, IsBestUnderAllReflections) {
  for (const Vector3d& signs :
       {Vector3d(-1, 1, 1), Vector3d(1, -1, 1), Vector3d(1, 1, -1), Vector3d(-1, -1, -1)}) {
    for (const Vector3d& sizes :
         {Vector3d(3, 2, 1), Vector3d(1, 1, 1), Vector3d(2, 2, 1), Vector3d(2, 1, 1)}) {
      const Matrix3d b = signs.cwiseProduct(sizes).asDiagonal();
      const Matrix3d r = fit_rotation(b);
      expect_rotation(r);
      const double best = b.determinant() < 0 ? sizes.sum() - 2 * sizes.minCoeff() : sizes.sum();
      EXPECT_NEAR(value(r, b), best, 1e-13);
    }
  }
}

TEST(RotationFit, StaysFiniteBetweenTheRanks) {
  std::mt19937 random(4);
  const Matrix3d u = AngleAxisd(0.7, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  for (double small = 1; small > 1e-20; small /= 10) {
    for (const double sign : {-1.0, 1.0}) {
      const Matrix3d b = u * Vector3d(1, small, sign * small * small).asDiagonal();
      const Matrix3d r = fit_rotation(b);
      expect_rotation(r);
      EXPECT_NEAR(value(r, b), value(fit_rotation_svd(b), b), 1e-14);
    }
  }
}

}  // namespace
}  // namespace lpdeform
