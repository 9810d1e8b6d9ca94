#include "core/shapes/distance_fields.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace lpdeform {
namespace {

using Point = Eigen::RowVector3d;

TEST(DistanceFields, CapsuleIsASegmentWithARadiusThatChangesAlongIt) {
  const Capsule capsule{{0, 0, 0}, {4, 0, 0}, 1, 2};
  EXPECT_DOUBLE_EQ(distance_to(capsule, Point(-3, 0, 0)), 2);
  EXPECT_DOUBLE_EQ(distance_to(capsule, Point(9, 0, 0)), 3);
  EXPECT_DOUBLE_EQ(distance_to(capsule, Point(2, 0, 5)), 3.5);
  EXPECT_DOUBLE_EQ(distance_to(capsule, Point(0, 0, 0)), -1);
}

TEST(DistanceFields, CylinderHasACapAndASideAndAnEdge) {
  const Cylinder cylinder{{1, 1, 1}, 2, 2, 5};
  EXPECT_DOUBLE_EQ(distance_to(cylinder, Point(1, 1, 9)), 3);
  EXPECT_DOUBLE_EQ(distance_to(cylinder, Point(5, 1, 2)), 2);
  EXPECT_DOUBLE_EQ(distance_to(cylinder, Point(1, 6, 10)), 5);  // 3 beyond the side, 4 beyond the cap
  EXPECT_DOUBLE_EQ(distance_to(cylinder, Point(1, 1, 1)), -2);
}

TEST(DistanceFields, BoxHasFacesAndCorners) {
  const Box box{{0, 0, 0}, {1, 2, 3}};
  EXPECT_DOUBLE_EQ(distance_to(box, Point(0, 5, 0)), 3);
  EXPECT_DOUBLE_EQ(distance_to(box, Point(2, 4, 5)), 3);
  EXPECT_DOUBLE_EQ(distance_to(box, Point(0, 0, 2.75)), -0.25);
}

TEST(DistanceFields, RoundingTakesEdgesOffAndKeepsFaces) {
  const Box box{{0, 0, 0}, {5, 5, 5}, 2};
  EXPECT_DOUBLE_EQ(distance_to(box, Point(7, 1, 1)), 2);
  EXPECT_DOUBLE_EQ(distance_to(box, Point(6, 7, 0)), 3);  // 3 and 4 beyond the edge's axis, less the radius
  const Cylinder cylinder{{0, 0, 0}, 0, 5, 5, 2};
  EXPECT_DOUBLE_EQ(distance_to(cylinder, Point(0, 0, 7)), 2);
  EXPECT_DOUBLE_EQ(distance_to(cylinder, Point(6, 7, 0)), 3);
}

TEST(DistanceFields, BlendsAreNearTheSharpOnesAwayFromTheirSeams) {
  EXPECT_NEAR(blended_union(std::array{1.0, 5.0}, 0.1), 1, 1e-12);
  EXPECT_NEAR(blended_union(std::array{1.0, 1.0}, 0.1), 1 - 0.1 * std::log(2), 1e-15);
  EXPECT_NEAR(blended_difference(-5, 1, 0.1), -1, 1e-12);  // the hole's wall is nearer than the solid's
  EXPECT_NEAR(blended_difference(-5, -2, 0.1), 2, 1e-12);  // inside the hole is outside
}

TEST(DistanceFields, BlendsOfFarDistancesStayFinite) {
  EXPECT_NEAR(blended_union(std::array{1e6, 2e6}, 1e-3), 1e6, 1e-6);
  EXPECT_EQ(blended_union(std::span<const double>(), 1), std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace lpdeform
