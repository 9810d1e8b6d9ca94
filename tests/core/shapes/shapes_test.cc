#include "core/shapes/shapes.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "core/mesh/report.h"
#include "tests/core/mesh_support.h"

namespace lpdeform {
namespace {

/// Volume inside a closed surface, positive where it is oriented outwards.
double signed_volume(const TriangleMesh& mesh) {
  double sum = 0;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    const Eigen::RowVector3d a = mesh.vertices.row(mesh.faces(f, 0)), b = mesh.vertices.row(mesh.faces(f, 1)),
                             c = mesh.vertices.row(mesh.faces(f, 2));
    sum += a.dot(b.cross(c)) / 6;
  }
  return sum;
}

void expect_sound(const TriangleMesh& mesh, std::int64_t boundary_loops, std::int64_t genus) {
  const MeshReport report = check_mesh(mesh);
  for (const Defect defect : all_defects()) EXPECT_EQ(report.of(defect).count, 0) << defect_name(defect);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.boundary_loops, boundary_loops);
  EXPECT_EQ(report.vertices - report.edges + report.faces,
            2 - 2 * genus - boundary_loops);  // Euler and Poincare
}

TEST(Shapes, BoxHasTheCountsOfThePapersBarAndSheet) {
  const TriangleMesh bar = box_surface(4, 4, 21), sheet = box_surface(2, 30, 60);
  EXPECT_EQ(bar.vertices.rows(), 370);
  EXPECT_EQ(bar.faces.rows(), 736);
  EXPECT_EQ(sheet.vertices.rows(), 3962);
  EXPECT_EQ(sheet.faces.rows(), 7920);
}

TEST(Shapes, BoxIsClosedAndOrientedOutwards) {
  for (const std::array<int, 3> n : {std::array{1, 1, 1}, std::array{4, 4, 21}, std::array{3, 1, 2}}) {
    const TriangleMesh box = box_surface(n[0], n[1], n[2]);
    expect_sound(box, 0, 0);
    EXPECT_NEAR(signed_volume(box), n[0] * n[1] * n[2], 1e-9);
    EXPECT_EQ(box.vertices.colwise().minCoeff(), Eigen::RowVector3d(0, 0, 0));
    EXPECT_EQ(box.vertices.colwise().maxCoeff(), Eigen::RowVector3d(n[0], n[1], n[2]));
  }
}

TEST(Shapes, GridIsADiscThatLooksUp) {
  const TriangleMesh flat = grid(5, 3);
  EXPECT_EQ(flat.vertices.rows(), 24);
  EXPECT_EQ(flat.faces.rows(), 30);
  expect_sound(flat, 1, 0);
  EXPECT_EQ(flat.vertices.col(2).cwiseAbs().maxCoeff(), 0);
  const Eigen::RowVector3d a = flat.vertices.row(flat.faces(0, 0)), b = flat.vertices.row(flat.faces(0, 1)),
                           c = flat.vertices.row(flat.faces(0, 2));
  EXPECT_GT((b - a).cross(c - a)[2], 0);
}

TEST(Shapes, GridBumpsReachTheirHeight) {
  const TriangleMesh bumpy = grid(50, 50, 2.5);
  expect_sound(bumpy, 1, 0);
  EXPECT_NEAR(bumpy.vertices.col(2).maxCoeff(), 2.5, 1e-12);
  EXPECT_NEAR(bumpy.vertices.col(2).minCoeff(), 0, 1e-12);
}

TEST(Shapes, BlockHasThreeTunnels) {
  for (const std::array<int, 3> n : {std::array{7, 3, 1}, std::array{8, 4, 2}, std::array{29, 12, 5}}) {
    expect_sound(block_with_holes(n[0], n[1], n[2]), 0, 3);
  }
  EXPECT_NEAR(signed_volume(block_with_holes(7, 3, 2)), 2 * (7 * 3 - 3), 1e-9);
  EXPECT_NEAR(signed_volume(block_with_holes(14, 9, 1)), 14 * 9 - 3 * 4, 1e-9);
}

TEST(Shapes, NeckedBarIsTwoBarsAndANeck) {
  const TriangleMesh bar = necked_bar(4, 12, 2, 4);
  expect_sound(bar, 0, 0);
  EXPECT_NEAR(signed_volume(bar), 8 * 16 + 4 * 4, 1e-9);
  EXPECT_EQ(necked_bar(4, 21, 4, 5).vertices, box_surface(4, 4, 21).vertices);
}

TEST(Shapes, SphereHasUnitRadiusAndItsCounts) {
  for (const int levels : {0, 1, 3}) {
    const TriangleMesh ball = sphere(levels);
    EXPECT_EQ(ball.vertices.rows(), 10 * std::pow(4, levels) + 2);
    expect_sound(ball, 0, 0);
    EXPECT_LT((ball.vertices.rowwise().norm().array() - 1).abs().maxCoeff(), 1e-15);
  }
  // An inscribed polyhedron of edge h misses about h^2 / 4 of the volume; h is 0.14 on level 3.
  EXPECT_NEAR(signed_volume(sphere(3)), 4 * std::numbers::pi / 3, 0.05);
}

TEST(Shapes, CreatureIsAClosedManifoldOfOnePiece) {
  for (const int resolution : {24, 31, 60}) {
    const TriangleMesh mesh = creature(resolution);
    expect_sound(mesh, 0, 0);
    EXPECT_GT(signed_volume(mesh), 0);
  }
}

/// The smallest angles of the triangles, in degrees: the least of all, and their mean.
struct SmallestAngles {
  double worst = 180, mean = 0;
};
SmallestAngles smallest_angles(const TriangleMesh& mesh) {
  SmallestAngles result;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    double smallest = 180;
    for (int k = 0; k < 3; ++k) {
      const Eigen::RowVector3d tip = mesh.vertices.row(mesh.faces(f, k));
      const Eigen::RowVector3d u = mesh.vertices.row(mesh.faces(f, (k + 1) % 3)) - tip;
      const Eigen::RowVector3d v = mesh.vertices.row(mesh.faces(f, (k + 2) % 3)) - tip;
      smallest = std::min(smallest, std::atan2(u.cross(v).norm(), u.dot(v)) * 180 / std::numbers::pi);
    }
    result.worst = std::min(result.worst, smallest);
    result.mean += smallest / mesh.faces.rows();
  }
  return result;
}

TEST(Shapes, ThoseOfFieldsHaveWellShapedTriangles) {
  for (const TriangleMesh& mesh : {creature(60), pierced_block(34), rocker_arm(63)}) {
    const SmallestAngles angles = smallest_angles(mesh);
    EXPECT_GT(angles.worst, 10);
    EXPECT_GT(angles.mean, 40);  // 60 would be equilateral throughout
  }
}

TEST(Shapes, PiercedBlockHasTwoCrossingTunnels) {
  for (const int resolution : {24, 34, 47}) {
    const TriangleMesh mesh = pierced_block(resolution);
    expect_sound(mesh, 0, 3);
    // Along both tunnels' axes the way is free.
    const auto from_x_axis = mesh.vertices.rightCols<2>().rowwise().norm();
    EXPECT_GT(from_x_axis.minCoeff(), 0.8 * PiercedBlock::kHoleRadius) << resolution;
    EXPECT_NEAR(mesh.vertices.col(0).maxCoeff(), PiercedBlock::kHalfSide, 0.5);
    EXPECT_NEAR(mesh.vertices.col(2).maxCoeff(), PiercedBlock::kHalfLength, 0.5);
  }
}

TEST(Shapes, RockerArmHasOneHole) {
  for (const int resolution : {32, 63, 90}) {
    const TriangleMesh mesh = rocker_arm(resolution);
    expect_sound(mesh, 0, 1);
    EXPECT_GT(signed_volume(mesh), 0);
    EXPECT_GT(mesh.vertices.leftCols<2>().rowwise().norm().minCoeff(), 0.8 * RockerArm::kHoleRadius);
  }
}

TEST(Shapes, FinerCreaturesEncloseTheSameVolume) {
  // Chords cut off a share of the volume that falls with the square of the spacing: 3 % at 40, about 1 %
  // at 70.
  EXPECT_NEAR(signed_volume(creature(70)) / signed_volume(creature(140)), 1, 0.015);
}

TEST(Shapes, ScanIsRoughAndHasSevenHoles) {
  const TriangleMesh mesh = scan(60);
  expect_sound(mesh, 7, 0);
  EXPECT_EQ(mesh.vertices, scan(60).vertices);
}

TEST(Shapes, TubeTreeIsClosedAndBranches) {
  const TriangleMesh mesh = tube_tree(96);
  expect_sound(mesh, 0, 0);
  EXPECT_GT(signed_volume(mesh), 0);
}

}  // namespace
}  // namespace lpdeform
