#include "core/analysis/joints.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numeric>
#include <random>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

const Workers kOne(1);

Field joints_of(const TriangleMesh& mesh) {
  return find_joints(*rest_shape(mesh), kOne).joint;
}

double mean_at(const Field& field, const std::vector<std::int32_t>& vertices) {
  double sum = 0;
  for (const std::int32_t i : vertices) sum += field[i];
  return sum / static_cast<double>(vertices.size());
}

TEST(Joints, AreAtTheNeckOfABarAndNowhereElse) {
  const TriangleMesh bar = necked_bar(8, 42, 4, 6);
  const Field joint = joints_of(bar);
  EXPECT_GT(mean_at(joint, slice(bar, 2, 19, 23)), 0.5);
  for (const std::int32_t i : slice(bar, 2, 0, 15)) EXPECT_LT(joint[i], 0.05) << i;
  for (const std::int32_t i : slice(bar, 2, 27, 42)) EXPECT_LT(joint[i], 0.05) << i;
}

TEST(Joints, AreNoneOnShapesOfOnePart) {
  EXPECT_LT(joints_of(box_surface(4, 4, 21)).maxCoeff(), 0.05);
  EXPECT_LT(joints_of(sphere(3)).maxCoeff(), 0.05);
  EXPECT_LT(joints_of(grid(8, 8)).maxCoeff(), 0.05);
}

TEST(Joints, OfACreatureAreWhereItsNeckMeetsItsTrunkMoreThanOnItsBack) {
  const TriangleMesh mesh = creature(48);
  const Field joint = joints_of(mesh);
  std::vector<std::int32_t> neck, back;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    const Eigen::RowVector3d x = mesh.vertices.row(i);
    if ((x - Eigen::RowVector3d(0.22, 0, 0.62)).norm() < 0.06) neck.push_back(static_cast<std::int32_t>(i));
    if (x[2] > 0.5 && x[0] > -0.2 && x[0] < 0) back.push_back(static_cast<std::int32_t>(i));
  }
  ASSERT_GT(neck.size(), 5u);
  ASSERT_GT(back.size(), 5u);
  EXPECT_GT(mean_at(joint, neck), 3 * mean_at(joint, back));
}

TEST(Joints, OfAnOpenSurfaceAreItsFoldsEitherWay) {
  TriangleMesh sheet = grid(20, 8);
  for (Eigen::Index i = 0; i < sheet.vertices.rows(); ++i) {  // up at x = 6, down again at x = 14
    const double x = sheet.vertices(i, 0);
    if (x > 6) sheet.vertices(i, 2) = std::min(x, 14.0) - 6;
    if (x > 14) sheet.vertices(i, 2) = 8 - (x - 14);
  }
  const Joints joints = find_joints(*rest_shape(sheet), kOne);
  const double first = mean_at(joints.joint, slice(sheet, 0, 6, 6));
  const double second = mean_at(joints.joint, slice(sheet, 0, 14, 14));
  EXPECT_GT(first, 0.4);
  EXPECT_GT(second, 0.4);
  EXPECT_LT(mean_at(joints.joint, slice(sheet, 0, 10, 10)), 0.2 * first);  // of two folds, each 4 rho away
  EXPECT_LT(mean_at(joints.joint, slice(sheet, 0, 0, 1)), 0.1 * first);
}

TEST(Joints, OfALongConcaveCreaseHaveItsAngle) {
  TriangleMesh sheet = grid(160, 40);  // folded by 90 degrees about x = 80; rho is 3.2 edges
  const std::vector<std::int32_t> crease = slice(sheet, 0, 80, 80);
  for (Eigen::Index i = 0; i < sheet.vertices.rows(); ++i) {
    const double beyond = sheet.vertices(i, 0) - 80;
    if (beyond > 0) sheet.vertices.row(i) += Eigen::RowVector3d(-beyond, 0, beyond);
  }
  const auto shape = rest_shape(sheet);
  const Joints joints = find_joints(*shape, kOne);
  // The kernel exp(-|x| / rho) sampled at edges 0.4 rho apart: 2 % are lost at its tip.
  EXPECT_NEAR(mean_at(joints.crease_radians, crease) / (std::numbers::pi / 2), 1, 0.05);
}

TEST(Joints, DoNotDependOnUnitPlaceOrTurn) {
  const TriangleMesh mesh = creature(32);
  const Field joint = joints_of(mesh);
  TriangleMesh moved = mesh;
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -0.5).normalized()));
  moved.vertices = (1e3 * mesh.vertices * turn.transpose()).rowwise() + Eigen::RowVector3d(40, -30, 20);
  EXPECT_LT((joints_of(moved) - joint).cwiseAbs().maxCoeff(), 1e-9);  // rounding
}

TEST(Joints, DoNotDependOnTheOrderOfVerticesAndFaces) {
  const TriangleMesh mesh = creature(32);
  const Field joint = joints_of(mesh);
  std::mt19937 random(3);
  std::vector<std::int32_t> place(mesh.vertices.rows()), order(mesh.faces.rows());
  std::iota(place.begin(), place.end(), 0);
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(place.begin(), place.end(), random);
  std::shuffle(order.begin(), order.end(), random);
  TriangleMesh mixed = mesh;
  for (std::size_t i = 0; i < place.size(); ++i) mixed.vertices.row(place[i]) = mesh.vertices.row(i);
  for (std::size_t f = 0; f < order.size(); ++f) {
    for (int k = 0; k < 3; ++k) mixed.faces(f, k) = place[mesh.faces(order[f], (k + f) % 3)];
  }
  const Field shuffled = joints_of(mixed);
  for (std::size_t i = 0; i < place.size(); ++i) EXPECT_NEAR(shuffled[place[i]], joint[i], 1e-9);
}

TEST(Joints, AreSmoothOverTheSurface) {
  const auto shape = rest_shape(necked_bar(16, 84, 8, 12));  // rho = 3 edges
  const Field joint = find_joints(*shape, kOne).joint;
  double largest = 0;
  for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
    for (std::int32_t k = shape->offsets()[i]; k < shape->offsets()[i + 1]; ++k)
      largest = std::max(largest, std::abs(joint[i] - joint[shape->neighbours()[k]]));
  }
  EXPECT_LT(largest, 0.25);
}

TEST(Joints, AgreeOnAFinerMeshOfTheSameShape) {
  const TriangleMesh coarse = necked_bar(8, 42, 4, 6), fine = necked_bar(16, 84, 8, 12);
  const Field a = joints_of(coarse), b = joints_of(fine);
  EXPECT_NEAR(mean_at(a, slice(coarse, 2, 19, 23)), mean_at(b, slice(fine, 2, 38, 46)), 0.05);
}

void expect_sound(const TriangleMesh& mesh) {
  const Field joint = joints_of(mesh);
  ASSERT_EQ(joint.size(), mesh.vertices.rows());
  EXPECT_TRUE(joint.allFinite());
  EXPECT_GE(joint.minCoeff(), 0);
  EXPECT_LE(joint.maxCoeff(), 1);
}

TEST(Joints, AreSoundOnBadMeshes) {
  TriangleMesh bar = box_surface(2, 2, 6);
  const auto n = static_cast<std::int32_t>(bar.vertices.rows());
  TriangleMesh degenerate = bar;
  degenerate.faces.row(0) << 0, 0, 1;  // a zero area, and a hole where the face was
  degenerate.vertices.row(n - 1) = degenerate.vertices.row(n - 2);
  expect_sound(degenerate);

  TriangleMesh loose = bar;  // a vertex that no face uses, and a component of zero-area faces alone
  loose.vertices.conservativeResize(n + 4, 3);
  loose.vertices.bottomRows(4) << 9, 9, 9, 5, 5, 5, 6, 6, 6, 7, 7, 7;
  loose.faces.conservativeResize(bar.faces.rows() + 1, 3);
  loose.faces.bottomRows(1) << n + 1, n + 2, n + 3;
  expect_sound(loose);
  EXPECT_EQ(joints_of(loose)[n], 0);

  TriangleMesh fan = bar;  // an edge of three faces, and faces that disagree
  fan.faces.conservativeResize(bar.faces.rows() + 1, 3);
  fan.faces.bottomRows(1) << fan.faces(0, 0), fan.faces(0, 1), n - 1;
  fan.faces.row(3).reverseInPlace();
  expect_sound(fan);
  expect_sound(grid(1, 1));
  TriangleMesh flat = bar;  // a box without height
  flat.vertices.col(0).setZero();
  expect_sound(flat);
}

}  // namespace
}  // namespace lpdeform
