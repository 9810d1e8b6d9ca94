#include "core/analysis/ellipsoid.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "tests/core/poses.h"
#include "tests/core/round_shapes.h"

namespace lpdeform {
namespace {

double farthest(const TriangleMesh& mesh) {
  return distance_from_ellipsoid(*rest_shape(mesh)).maxCoeff();
}

TEST(DistanceFromEllipsoid, IsNoneOnEllipsoidsHoweverTheyLieAndAreSampled) {
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()));
  for (TriangleMesh mesh : {ball_with_poles(16, 8), ball_with_poles(9, 40), sphere(0), sphere(3)}) {
    for (const Eigen::Vector3d& axes : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, 2, 3),
                                        Eigen::Vector3d(100, 1, 1), Eigen::Vector3d(1, 1, 0.01)}) {
      TriangleMesh ellipsoid = mesh;
      ellipsoid.vertices =
          (mesh.vertices * axes.asDiagonal() * turn).rowwise() + Eigen::RowVector3d(50, -20, 7);
      EXPECT_LT(farthest(ellipsoid), 1e-6) << axes.transpose();
    }
  }
}

TEST(DistanceFromEllipsoid, IsAsLargeAsTheNoise) {
  TriangleMesh mesh = ball_with_poles(64, 32);
  mesh.vertices = with_noisy_radii(mesh.vertices, 0.01);
  const double far = farthest(mesh);
  EXPECT_GT(far, 0.02);
  EXPECT_LT(far, 0.05);
  mesh.vertices *= Eigen::Vector3d(1, 7, 2).asDiagonal();
  EXPECT_NEAR(farthest(mesh), far, 0.01);
}

TEST(DistanceFromEllipsoid, IsLargeAtTheCornersOfACube) {
  EXPECT_GT(farthest(box_surface(10, 10, 10)), 0.25);
}

// Two rings lie on many ellipsoids, a tube on none that ends, a sheet is flat, and eight vertices are too few.
TEST(DistanceFromEllipsoid, IsOneWhereNoEllipsoidIsNearest) {
  TriangleMesh tube = grid(16, 30);
  for (auto x : tube.vertices.rowwise()) {
    const double turn = 2 * std::numbers::pi * x[0] / 16.5;
    x = Eigen::RowVector3d(2.5 * std::cos(turn), 2.5 * std::sin(turn), x[1]);
  }
  TriangleMesh ring = grid(16, 1);
  for (auto x : ring.vertices.rowwise()) {
    const double turn = 2 * std::numbers::pi * x[0] / 16.5;
    x = Eigen::RowVector3d(std::cos(turn), std::sin(turn), x[1]);
  }
  for (const TriangleMesh& mesh : {tube, ring, grid(9, 9), box_surface(1, 1, 1)})
    EXPECT_EQ(distance_from_ellipsoid(*rest_shape(mesh)), Field::Ones(mesh.vertices.rows()));
}

}  // namespace
}  // namespace lpdeform
