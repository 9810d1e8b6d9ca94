#include "core/analysis/bending.h"

#include <gtest/gtest.h>

#include <numbers>

#include "core/analysis/surface_smoother.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

constexpr double kPi = std::numbers::pi;

double trace(const BendingMeasure& measure) {
  return measure.diagonal.sum();
}

TEST(Bending, OfABoxIsItsEdgesByTheirAngle) {
  const auto shape = rest_shape(box_surface(2, 3, 4));
  const double length = 4 * (2 + 3 + 4) / shape->mean_edge_length();
  EXPECT_NEAR(trace(bending_measure(*shape)), kPi / 2 * length, 1e-9);
}

TEST(Bending, IsNegativeInConcaveEdges) {
  const auto necked =
      rest_shape(necked_bar(4, 12, 2, 4));  // two collars of 8 concave units, 8 convex ones more
  const double unit = necked->mean_edge_length();
  const double convex = 2 * (8 * 4) + 4 * 8 + 4 * 4,
               concave = 2 * 8;  // rims of the ends, long edges, collars
  EXPECT_NEAR(trace(bending_measure(*necked)) * unit, kPi / 2 * (convex - concave), 1e-9);
  EXPECT_NEAR(trace(bending_measure(*necked, true)) * unit, kPi / 2 * (convex + concave), 1e-9);
}

TEST(Bending, OfASphereIsItsMeanCurvature) {
  const auto shape = rest_shape(sphere(3));
  const double radius = 1 / shape->mean_edge_length();
  // The integral of the trace, 2 / r, over 4 pi r^2; the inscribed polyhedron has a little less of both.
  EXPECT_NEAR(trace(bending_measure(*shape)) / (8 * kPi * radius), 1, 0.01);
}

TEST(Bending, IsNoneAlongAStraightEdge) {
  const BendingMeasure measure = bending_measure(*rest_shape(box_surface(2, 2, 6)));
  for (Eigen::Index i = 0; i < measure.diagonal.rows(); ++i) {
    EXPECT_TRUE(measure.at(i).isApprox(measure.at(i).transpose()));
  }
  const TriangleMesh bar = box_surface(2, 2, 6);
  for (const std::int32_t i : slice(bar, 2, 1, 5)) EXPECT_NEAR(measure.at(i)(2, 2), 0, 1e-12) << i;
}

TEST(SurfaceSmoother, KeepsIntegralsAndSigns) {
  const auto shape = rest_shape(sphere(2));
  SurfaceSmoother smoother(*shape);
  ASSERT_TRUE(smoother.set_lengths({2.0}));
  Points b = Points::Zero(shape->vertex_count(), 3);
  b(0, 0) = 1;
  b(5, 1) = 2;
  const Points u = smoother.spread(b);
  EXPECT_NEAR(u.col(0).dot(smoother.areas()), 1, 1e-12);
  EXPECT_NEAR(u.col(1).dot(smoother.areas()), 2, 1e-12);
  EXPECT_GE(u.leftCols(2).minCoeff(), 0);
  EXPECT_TRUE(u.col(2).isZero(0));
}

TEST(SurfaceSmoother, LeavesAConstantAsItIs) {
  const auto shape = rest_shape(creature(24));
  SurfaceSmoother smoother(*shape);
  ASSERT_TRUE(smoother.set_lengths({3.0}));
  const Points u = smoother.spread(smoother.areas().replicate(1, 3));
  EXPECT_LT((u.array() - 1).abs().maxCoeff(), 1e-10);
}

}  // namespace
}  // namespace lpdeform
