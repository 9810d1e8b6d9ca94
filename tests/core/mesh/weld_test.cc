#include "core/mesh/weld.h"

#include <limits>

#include "support.h"
#include "tests/core/split_shapes.h"

namespace lpdeform {
namespace {

using testing::ElementsAre;

TEST(Weld, MakesVerticesAtOnePositionOneInOrderOfFirstAppearance) {
  Points points(6, 3);
  points << 1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 5, -0.0, 0, 0, 1, 0, 1e-300;
  const Weld weld = weld_by_position(points);
  EXPECT_THAT(weld.to_welded, ElementsAre(0, 1, 0, 2, 1, 3));
  EXPECT_THAT(weld.first_copy, ElementsAre(0, 1, 3, 5));
}

TEST(Weld, LeavesVerticesThatAreNotFiniteAlone) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  Points points(4, 3);
  points << nan, 0, 0, nan, 0, 0, inf, 0, 0, inf, 0, 0;
  EXPECT_EQ(weld_by_position(points).welded_count(), 4);
}

TEST(Weld, UndoesASplit) {
  const TriangleMesh mesh = box_surface(3, 2, 4);
  for (const TriangleMesh& split : {split_at_every_corner(mesh), split_along_seam(sphere(2))}) {
    const Weld weld = weld_by_position(split.vertices);
    const TriangleMesh back = welded(split, weld);
    EXPECT_EQ(check_mesh(back).boundary_loops, 0);
    EXPECT_EQ(check_mesh(back).components, 1);
    EXPECT_TRUE(same_bits(scattered(back.vertices, weld), split.vertices));
  }
  EXPECT_EQ(weld_by_position(split_at_every_corner(mesh).vertices).welded_count(), mesh.vertices.rows());
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
  EXPECT_EQ(weld_by_position(Points(0, 3)).welded_count(), 0);
  EXPECT_EQ(weld_by_groups(Points(0, 3), {})->welded_count(), 0);
}

TEST(Weld, KeepsIndicesThatAreOutOfRangeOutOfRange) {
  TriangleMesh mesh = make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 0, 0}}, {{0, 1, 7}, {-1, 1, 2}});
  mesh = welded(mesh, weld_by_position(mesh.vertices));
  EXPECT_EQ(check_mesh(mesh).index_out_of_range.count, 2);
}

TEST(Weld, ReportsNameTheLowestCopies) {
  // Vertex 1 is a copy of 0; two triangles in one plane, and a vertex that none uses.
  const TriangleMesh split = make_mesh({{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {9, 9, 9}},
                                       {{0, 2, 3}, {1, 4, 2}, {0, 0, 2}});
  const Weld weld = weld_by_position(split.vertices);
  const MeshReport report = scattered(check_mesh(welded(split, weld)), weld);
  EXPECT_EQ(report.vertices, 6);
  EXPECT_THAT(report.unreferenced_vertices.first, ElementsAre(5));
  EXPECT_THAT(report.zero_area_faces.first, ElementsAre(2));
}

}  // namespace
}  // namespace lpdeform
