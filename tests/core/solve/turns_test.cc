#include "core/solve/turns.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

const Workers kOne(1);
const Eigen::Vector3d kAxis = Eigen::Vector3d(1, -2, 0.5).normalized();

Eigen::Matrix3d about_axis(double angle) {
  return Eigen::AngleAxisd(angle, kAxis).toRotationMatrix();
}

double difference(const Turn& turn, const Eigen::Matrix3d& rotation) {
  return (turn.cast<double>() - rotation.transpose()).norm();
}

/// A bumpy sheet, and the same turned and moved.
class Turns : public testing::Test {
 protected:
  Points moved(double angle) const {
    return (mesh.vertices * about_axis(angle).transpose()).rowwise() + Eigen::RowVector3d(3, -1, 7);
  }

  const TriangleMesh mesh = grid(9, 7, 2);
  const std::shared_ptr<const RestShape> shape = rest_shape(mesh);
};

TEST_F(Turns, ARigidMotionIsFoundExactly) {
  for (const double angle : {-1.5, -0.3, 0.0, 1e-4, 0.05, 1.0, 1.57}) {
    for (const Turn& turn : turns_between(*shape, mesh.vertices, moved(angle), 1, kOne))
      EXPECT_LE(difference(turn, about_axis(angle)), 2e-5) << angle;
  }
}

TEST_F(Turns, MoreThanARightAngleCountsAsNone) {
  for (const double angle : {1.58, 2.5, 3.0}) {
    for (const Turn& turn : turns_between(*shape, mesh.vertices, moved(angle), 0.5, kOne))
      EXPECT_EQ(turn, Turn::Identity()) << angle;
  }
}

/// Of a surface that does not move rigidly: v_i is recovered from the rotation.
TEST_F(Turns, SolveTheWeightedLeastSquares) {
  Points now = moved(0.7);
  for (Eigen::Index i = 0; i < now.rows(); ++i)
    now.row(i) += 0.2 * Eigen::RowVector3d(std::sin(3.0 * double(i)), std::sin(5.0 * double(i)),
                                           std::sin(7.0 * double(i)));
  const std::vector<Turn> turns = turns_between(*shape, mesh.vertices, now, 1, kOne);
  const auto [least, most] = std::minmax_element(shape->weights().begin(), shape->weights().end());
  ASSERT_LT(*least, 0.5 * *most);  // else weights would not matter
  for (Eigen::Index i = 0; i < now.rows(); ++i) {
    const Eigen::AngleAxisd turn(
        Eigen::Matrix3d(turns[static_cast<std::size_t>(i)].transpose().cast<double>()));
    const Eigen::Vector3d v = 2 * std::tan(0.5 * turn.angle()) * turn.axis();
    Eigen::Vector3d rest = Eigen::Vector3d::Zero();
    double size = 0;
    for (std::int32_t k = shape->offsets()[i]; k < shape->offsets()[i + 1]; ++k) {
      const std::int32_t j = shape->neighbours()[k];
      const Eigen::Vector3d e = mesh.vertices.row(i) - mesh.vertices.row(j), f = now.row(i) - now.row(j);
      const Eigen::Vector3d mean = 0.5 * (e + f);
      rest += shape->weights()[k] * mean.cross(f - e - v.cross(mean));
      size += shape->weights()[k] * mean.squaredNorm();
    }
    EXPECT_LE(rest.norm(), 1e-5 * size) << i;
  }
}

TEST_F(Turns, AShareOfItIsThatOfTheAngleToThirdOrder) {
  for (const double share : {0.25, 0.5, 1.5, 1.9}) {
    const std::vector<Turn> turns = turns_between(*shape, mesh.vertices, moved(0.1), share, kOne);
    for (const Turn& turn : turns) EXPECT_LE(difference(turn, about_axis(0.1 * share)), 1e-3) << share;
  }
}

/// A flat sheet on a cylinder of radius 10: what is at x turns by 0.1 x.
TEST(TurnsOfASheet, ABendTurnsEachVertexByItsOwnAngle) {
  const TriangleMesh flat = grid(9, 7, 0);
  Points bent = flat.vertices;
  for (Eigen::Index i = 0; i < bent.rows(); ++i) {
    const double angle = 0.1 * bent(i, 0);
    bent(i, 0) = 10 * std::sin(angle);
    bent(i, 2) = 10 * (std::cos(angle) - 1);
  }
  const std::vector<Turn> turns = turns_between(*rest_shape(flat), flat.vertices, bent, 1, kOne);
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const double x = flat.vertices(static_cast<Eigen::Index>(i), 0);
    if (x == 0 || x == 9) continue;  // edges to one side only
    const Eigen::AngleAxisd expected(0.1 * x, Eigen::Vector3d::UnitY());
    EXPECT_LE(difference(turns[i], expected.toRotationMatrix()), 0.005) << x;
  }
}

TEST_F(Turns, AllTurnsAreRotations) {
  Points now = moved(1.2);
  for (Eigen::Index i = 0; i < now.rows(); ++i) now.row(i) *= 1 + 0.3 * std::sin(7.0 * double(i));
  for (const Turn& turn : turns_between(*shape, mesh.vertices, now, 1.7, kOne)) {
    EXPECT_LE((turn * turn.transpose() - Turn::Identity()).norm(), 1e-5);
    EXPECT_GT(turn.determinant(), 0);
  }
}

TEST_F(Turns, WhereNothingOrOnlyALineIsLeftThereIsATurnThatIsFinite) {
  const Points point = Points::Zero(mesh.vertices.rows(), 3);
  for (const Turn& turn : turns_between(*shape, point, point, 1, kOne)) EXPECT_EQ(turn, Turn::Identity());
  Points line = point, across = point;
  line.col(0) = mesh.vertices.col(0) + 0.37 * mesh.vertices.col(1);
  across.col(1) = line.col(0);
  for (const Turn& turn : turns_between(*shape, line, across, 1, kOne)) {
    EXPECT_TRUE(turn.allFinite());
    EXPECT_LE((Eigen::RowVector3f(1, 0, 0) * turn - Eigen::RowVector3f(0, 1, 0)).norm(), 1e-5);
    EXPECT_LE((Eigen::RowVector3f(0, 0, 1) * turn - Eigen::RowVector3f(0, 0, 1)).norm(), 1e-5);
  }
  for (const Turn& turn : turns_between(*shape, line, -line, 1, kOne)) EXPECT_EQ(turn, Turn::Identity());
  Points flipped = -line;
  flipped.col(2) += 1e-9 * mesh.vertices.col(1);
  for (const Turn& turn : turns_between(*shape, line, flipped, 1, kOne))
    EXPECT_LE((turn * turn.transpose() - Turn::Identity()).norm(), 1e-5);
}

TEST(TurnsOfALargeMesh, AreTheSameBitsOnAnyNumberOfThreads) {
  const TriangleMesh mesh = grid(80, 80, 2);
  const auto shape = rest_shape(mesh);
  Points now = mesh.vertices;
  now.col(2) += 0.01 * mesh.vertices.col(0).cwiseAbs2();
  const std::vector<Turn> one = turns_between(*shape, mesh.vertices, now, 1.2, kOne);
  for (const int threads : {2, 3, 7})
    EXPECT_EQ(turns_between(*shape, mesh.vertices, now, 1.2, Workers(threads)), one);
}

}  // namespace
}  // namespace lpdeform
