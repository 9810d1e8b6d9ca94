#include "client/cli/reproduce/statistics.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <numeric>

namespace lpdeform::reproduce {
namespace {

/// Points of a circle of radius 2 in the plane z = 5, unevenly far apart.
Points circle(int count) {
  Points points(count, 3);
  for (int k = 0; k < count; ++k) {
    const double angle = 2 * std::numbers::pi * std::pow(double(k) / count, 1.5);
    points.row(k) << 2 * std::cos(angle), 2 * std::sin(angle), 5;
  }
  return points;
}

std::vector<std::int32_t> all(int count) {
  std::vector<std::int32_t> indices(count);
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

TEST(AxisRatio, IsOneWhereACircleStaysOne) {
  const Points rest = circle(17);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  const Points moved = (3 * rest * turn.transpose()).rowwise() + Eigen::RowVector3d(7, 8, 9);
  EXPECT_NEAR(axis_ratio(rest, rest, all(17)), 1, 1e-12);
  EXPECT_NEAR(axis_ratio(rest, moved, all(17)), 1, 1e-12);
}

TEST(AxisRatio, IsTheStretchWhateverTheSamplingAndTheDirection) {
  const Points rest = circle(17);
  Points stretched = rest;
  stretched.col(0) *= 1.5;
  EXPECT_NEAR(axis_ratio(rest, stretched, all(17)), 1.5, 1e-12);
  EXPECT_NEAR(axis_ratio(stretched, rest, all(17)), 1.5, 1e-12);
  Points flattened = rest;
  flattened.col(1) /= 4;
  EXPECT_NEAR(axis_ratio(rest, flattened, all(17)), 4, 1e-12);
}

TEST(AxisRatio, LooksAtItsRimAlone) {
  const Points rest = circle(17);
  Points moved = rest;
  moved.row(16) << 100, 100, 100;
  EXPECT_NEAR(axis_ratio(rest, moved, all(16)), 1, 1e-12);
}

TEST(AxisRatio, IsInfiniteWhereARimHasCollapsedIntoALine) {
  const Points rest = circle(17);
  Points line = rest;
  line.col(1).setZero();
  line.col(2).setZero();
  EXPECT_GT(axis_ratio(rest, line, all(17)), 1e12);
}

TEST(DisplacementFarFrom, LeavesOutWhatIsNear) {
  Points rest(4, 3), moved(4, 3);
  rest << 0, 0, 0, 1, 0, 0, 4, 0, 0, 0, 6, 0;
  moved << 9, 9, 9, 9, 9, 9, 4, 3, 0, 0, 6, 4;  // the far two have moved by 3 and 4
  const std::vector<std::int32_t> from{0, 1};
  EXPECT_DOUBLE_EQ(displacement_far_from(rest, moved, from, 2), std::sqrt(12.5));
  EXPECT_DOUBLE_EQ(displacement_far_from(rest, moved, from, 5), 4);
  EXPECT_EQ(displacement_far_from(rest, moved, from, 100), 0);
}

TEST(ShareUpTo, CountsValuesAtTheLimit) {
  EXPECT_DOUBLE_EQ(share_up_to(Field{{0, 1, 2, 3}}, 1), 0.5);
  EXPECT_EQ(share_up_to(Field(), 1), 0);
}

TEST(TopShare, IsThatOfTheLargestTwentieth) {
  Field values = Field::Ones(40);
  values[7] = values[30] = 31;  // ceil(40 / 20) = 2 of them: 62 of 100
  EXPECT_DOUBLE_EQ(top_share(values), 0.62);
  EXPECT_EQ(top_share(Field::Zero(5)), 0);
}

TEST(Histogram, CountsEachValueOnceAndPutsTheHighestIntoTheLastBin) {
  EXPECT_EQ(histogram(Field{{0, 0.9, 1, 2.5, 4, 7}}, 4, 4), (std::vector<std::int64_t>{2, 1, 1, 2}));
}

TEST(At, PicksValuesInTheOrderAskedFor) {
  EXPECT_EQ(at(Field{{5, 6, 7}}, std::vector<std::int32_t>{2, 0}), (Field{{7, 5}}));
}

TEST(Diagonal, IsOfTheBoundingBox) {
  Points points(3, 3);
  points << -1, 0, 0, 1, 2, 0, 0, 0, 1;
  EXPECT_DOUBLE_EQ(diagonal(points), 3);
}

}  // namespace
}  // namespace lpdeform::reproduce
