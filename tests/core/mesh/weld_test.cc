#include "core/mesh/weld.h"

#include <limits>
#include <random>

#include "tests/core/mesh_support.h"
#include "tests/core/split_shapes.h"

namespace lpdeform {
namespace {

using testing::ElementsAre;

TEST(Weld, MakesVerticesAtOnePositionOneInOrderOfFirstAppearance) {
  Points points(6, 3);
  points << 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 5, -0.0, 0, 0, 1, 0, 1e-3;
  const Weld weld = weld_by_position(points).value();
  EXPECT_THAT(weld.to_welded, ElementsAre(0, 1, 0, 2, 1, 3));
  EXPECT_THAT(weld.first_copy, ElementsAre(0, 1, 3, 5));
}

TEST(Weld, LeavesVerticesThatAreNotFiniteAlone) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  Points points(4, 3);
  points << nan, 0, 0, nan, 0, 0, inf, 0, 0, inf, 0, 0;
  EXPECT_EQ(weld_by_position(points).value().welded_count(), 4);
}

TEST(Weld, UndoesASplit) {
  const TriangleMesh mesh = box_surface(3, 2, 4);
  for (const TriangleMesh& split : {split_at_every_corner(mesh), split_along_seam(sphere(2))}) {
    const Weld weld = weld_by_position(split.vertices).value();
    const TriangleMesh back = welded(split, weld);
    EXPECT_EQ(check_mesh(back).boundary_loops, 0);
    EXPECT_EQ(check_mesh(back).components, 1);
    EXPECT_TRUE(same_bits(scattered(back.vertices, weld), split.vertices));
  }
  EXPECT_EQ(weld_by_position(split_at_every_corner(mesh).vertices).value().welded_count(),
            mesh.vertices.rows());
}

TEST(Weld, ByGroupsTakesNearCopiesAndRefusesFarOnes) {
  Points points(4, 3);
  points << 0, 0, 0, 1, 0, 0, 1, 1e-7, 0, 0, 1, 0;
  const std::vector<std::uint32_t> groups{3, 1, 1, 0};
  const Weld weld = weld_by_groups(points, groups).value();
  EXPECT_THAT(weld.to_welded, ElementsAre(0, 1, 1, 2));
  points(2, 1) = 1e-3;
  EXPECT_EQ(fault_of(weld_by_groups(points, groups).status()).reason, "WELD_TOO_FAR");
  EXPECT_EQ(fault_of(weld_by_groups(points, groups).status()).element, "vertex 2");
}

TEST(Weld, ByGroupsNeedsANumberInRangeForEachVertex) {
  const Points points = Points::Zero(3, 3);
  EXPECT_EQ(fault_of(weld_by_groups(points, std::vector<std::uint32_t>{0, 0}).status()).reason, "WELD_SIZE");
  const Fault fault = fault_of(weld_by_groups(points, std::vector<std::uint32_t>{0, 1, 3}).status());
  EXPECT_EQ(fault.reason, "WELD_OUT_OF_RANGE");
  EXPECT_EQ(fault.element, "vertex 2");
}

TEST(Weld, OfNothingIsNothing) {
  EXPECT_EQ(weld_by_position(Points(0, 3)).value().welded_count(), 0);
  EXPECT_EQ(weld_by_groups(Points(0, 3), {})->welded_count(), 0);
}

TEST(Weld, KeepsIndicesThatAreOutOfRangeOutOfRange) {
  TriangleMesh mesh = make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}, {{0, 1, 7}, {-1, 1, 2}});
  mesh = welded(mesh, weld_by_position(mesh.vertices).value());
  EXPECT_EQ(check_mesh(mesh).index_out_of_range.count, 2);
}

TEST(Weld, ReportsNameTheLowestCopies) {
  // Vertex 1 is a copy of 0; two triangles in one plane, and a vertex that none uses.
  const TriangleMesh split = make_mesh({{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {9, 9, 9}},
                                       {{0, 2, 3}, {1, 4, 2}, {0, 0, 2}});
  const Weld weld = weld_by_position(split.vertices).value();
  const MeshReport report = scattered(check_mesh(welded(split, weld)), weld);
  EXPECT_EQ(report.vertices, 6);
  EXPECT_THAT(report.unreferenced_vertices.first, ElementsAre(5));
  EXPECT_THAT(report.zero_area_faces.first, ElementsAre(2));
}

TEST(Weld, TakesVerticesThatAreApartByRounding) {
  const TriangleMesh split = uv_sphere(12, 16);
  const MeshReport apart = check_mesh(split);
  EXPECT_GT(apart.boundary_loops, 0);
  const Weld weld = weld_by_position(split.vertices).value();
  EXPECT_EQ(weld.welded_count(), 11 * 16 + 2);
  const MeshReport report = check_mesh(welded(split, weld));
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.boundary_loops, 0);
  EXPECT_EQ(report.split_border_vertices.count, 0);
  EXPECT_EQ(report.zero_area_faces.count, 2 * 16) << "the poles' faces, which have no inside";
}

TEST(Weld, IsTheSameOnBothSidesOfACellOfItsGrid) {
  constexpr double kTolerance = 1e-4;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> place(0, 1), direction(-1, 1);
  Points points(4000, 3);
  points.row(0).setZero();
  points.row(1).setOnes();
  const double nearest = kTolerance * std::sqrt(3.0);
  for (Eigen::Index k = 2; k < points.rows(); k += 2) {
    for (int axis = 0; axis < 3; ++axis) points(k, axis) = place(random);
    const Eigen::RowVector3d way(direction(random), direction(random), direction(random));
    points.row(k + 1) = points.row(k) + (k % 4 == 0 ? 0.999 : 1.001) * nearest * way.normalized();
    points.row(k + 1) = points.row(k + 1).cwiseMax(0).cwiseMin(1);
  }
  const Weld weld = weld_by_position(points, kTolerance).value();
  int welded_pairs = 0;
  for (Eigen::Index k = 2; k < points.rows(); k += 2) {
    const bool is_near = (points.row(k) - points.row(k + 1)).norm() <= nearest;
    EXPECT_EQ(weld.to_welded[k] == weld.to_welded[k + 1], is_near) << k;
    welded_pairs += is_near;
  }
  EXPECT_GT(welded_pairs, 900);
  EXPECT_LT(welded_pairs, 1100);
}

TEST(Weld, ConnectsChainsAndTakesTheLowestCopysPosition) {
  Points points(12, 3);
  points.setZero();
  points(0, 0) = 1;
  for (Eigen::Index k = 1; k < 12; ++k) points(k, 1) = 0.9e-3 * static_cast<double>((5 * k) % 11);
  const Weld weld = weld_by_position(points, 1e-3).value();
  EXPECT_EQ(weld.welded_count(), 2);
  EXPECT_EQ(scattered(welded({points, Faces(0, 3)}, weld).vertices, weld)(7, 1), points(1, 1));
  EXPECT_EQ(weld_by_position(points, 0.8e-3)->welded_count(), 12);
}

TEST(Weld, DoesNotDependOnTheUnitOfLength) {
  for (const double unit : {1e-300, 1e-160, 1.0, 1e160, 1e307}) {
    Points points(4, 3);
    points << 0, 0, 0, 1, 0, 0, 1, 5e-7, 0, 1, 5e-6, 0;
    const Weld weld = weld_by_position(unit * points).value();
    EXPECT_THAT(weld.to_welded, ElementsAre(0, 1, 1, 2)) << unit;
  }
}

TEST(Weld, HoldsTogetherASphereOfSinglePrecisionWherever) {
  for (const double place : {0.0, 5.0}) {
    TriangleMesh mesh = uv_sphere<float>(16, 32);
    mesh.vertices.col(0).array() += place;
    mesh.vertices = mesh.vertices.cast<float>().cast<double>().eval();
    EXPECT_EQ(weld_by_position(mesh.vertices)->welded_count(), 2 + 15 * 32) << place;
  }
}

TEST(Weld, RefusesAToleranceOutOfRange) {
  const Points points = Points::Identity(3, 3);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double tolerance : {-1e-9, 1.001e-3, nan}) {
    const Fault fault = fault_of(weld_by_position(points, tolerance).status());
    EXPECT_EQ(fault.reason, "WELD_TOLERANCE");
    EXPECT_EQ(fault.limit, "0 <= tolerance <= 0.001");
  }
  EXPECT_TRUE(weld_by_position(points, 1e-3).ok());
}

TEST(Weld, EndsEarlyWhereVerticesLieTooDensely) {
  Points points(20000, 3);
  for (Eigen::Index k = 0; k < points.rows(); ++k) points.row(k).setConstant(1e-8 * static_cast<double>(k));
  points.row(0).setOnes();
  EXPECT_EQ(fault_of(weld_by_position(points, 1e-3).status()).reason, "WELD_TOO_DENSE");
  points.bottomRows(19999).setZero();  // in one place are as many as there may be
  EXPECT_EQ(weld_by_position(points, 1e-3)->welded_count(), 2);
}

}  // namespace
}  // namespace lpdeform
