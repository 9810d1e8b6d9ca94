#include "core/analysis/girth.h"

#include <gtest/gtest.h>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

TEST(Girth, OfABarIsTheSameAllAlongIt) {
  const TriangleMesh bar = box_surface(4, 4, 40);
  const Field girth = girth_along(*rest_shape(bar), Eigen::Vector3d::UnitZ());
  EXPECT_NEAR(girth.minCoeff(), 1, 1e-9);
  EXPECT_NEAR(girth.maxCoeff(), 1, 1e-9);
}

// Slices through a ball are circles, 2 pi sqrt(r^2 - h^2), pi^2 r / 2 in the mean.
TEST(Girth, OfABallFallsTowardsItsEnds) {
  TriangleMesh ball = box_surface(20, 20, 20);
  ball.vertices = (ball.vertices.array() - 10).matrix().rowwise().normalized();
  const Field girth = girth_along(*rest_shape(ball), Eigen::Vector3d::UnitX());
  for (Eigen::Index i = 0; i < ball.vertices.rows(); ++i) {
    const double h = ball.vertices(i, 0);
    if (std::abs(h) > 0.9) continue;
    EXPECT_NEAR(girth[i], 4 / EIGEN_PI * std::sqrt(1 - h * h), 0.05) << h;
  }
}

TEST(Girth, DoesNotDependOnTheUnitNorOnOtherComponents) {
  const TriangleMesh one = creature(24);
  const Eigen::Index n = one.vertices.rows(), m = one.faces.rows();
  TriangleMesh two = one;
  two.vertices.conservativeResize(2 * n, 3);
  two.vertices.bottomRows(n) = 7 * one.vertices;
  two.faces.conservativeResize(2 * m, 3);
  two.faces.bottomRows(m) = one.faces.array() + static_cast<std::int32_t>(n);
  const Field alone = girth_along(*rest_shape(one), Eigen::Vector3d::UnitZ());
  const Field both = girth_along(*rest_shape(two), Eigen::Vector3d::UnitZ());
  EXPECT_LT((both.head(n) - alone).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_LT((both.tail(n) - alone).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Girth, IsOneWhereThereIsNoExtent) {
  TriangleMesh sheet = grid(3, 3, 0);
  sheet.vertices.conservativeResize(sheet.vertices.rows() + 1, 3);  // and a vertex that no face uses
  sheet.vertices.bottomRows(1).setConstant(50);
  const Field girth = girth_along(*rest_shape(sheet), Eigen::Vector3d::UnitZ());
  EXPECT_EQ(girth, Field::Ones(sheet.vertices.rows()));
}

}  // namespace
}  // namespace lpdeform
