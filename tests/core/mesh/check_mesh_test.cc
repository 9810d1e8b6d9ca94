#include <cmath>
#include <limits>

#include "core/mesh/report.h"
#include "core/mesh/weld.h"
#include "core/shapes/shapes.h"
#include "tests/core/mesh_support.h"
#include "tests/core/split_shapes.h"

namespace lpdeform {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

const std::vector<std::array<double, 3>> kCorners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 1}};
const std::vector<std::array<std::int32_t, 3>> kTetrahedron{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};

/// A strip of `length` quadrilaterals closed into a ring, with a half twist where `is_twisted`.
TriangleMesh ring(int length, bool is_twisted) {
  std::vector<std::array<double, 3>> vertices;
  for (int k = 0; k < length; ++k) {
    const double turn = 2 * M_PI * k / length, tilt = is_twisted ? turn / 2 : 0;
    for (const double side : {-0.3, 0.3}) {
      const double radius = 1 + side * std::cos(tilt);
      vertices.push_back({radius * std::cos(turn), radius * std::sin(turn), side * std::sin(tilt)});
    }
  }
  std::vector<std::array<std::int32_t, 3>> faces;
  for (int k = 0; k < length; ++k) {
    const bool is_seam = is_twisted && k == length - 1;
    const int a = 2 * k, b = a + 1, next = 2 * ((k + 1) % length);
    const int c = is_seam ? next + 1 : next, d = is_seam ? next : next + 1;
    faces.push_back({a, b, d});
    faces.push_back({a, d, c});
  }
  return make_mesh(vertices, faces);
}

TriangleMesh welded_uv_sphere() {
  const TriangleMesh split = uv_sphere(12, 16);
  return welded(split, weld_by_position(split.vertices).value());
}

TEST(CheckMesh, FindsNothingInASoundMesh) {
  const MeshReport report = check_mesh(box_surface(2, 3, 4));
  EXPECT_EQ(report.vertices, 54);
  EXPECT_EQ(report.faces, 104);
  EXPECT_EQ(report.edges, 156);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.boundary_loops, 0);
  for (const Defect defect : all_defects()) {
    EXPECT_EQ(report.of(defect).count, 0) << defect_name(defect);
    EXPECT_THAT(report.of(defect).first, IsEmpty());
  }
  EXPECT_TRUE(deformable(report).ok());
}

TEST(CheckMesh, CountsTheDefectsOfEveryKindUnderDifferentNames) {
  std::vector<std::string_view> names;
  for (const Defect defect : all_defects()) names.push_back(defect_name(defect));
  EXPECT_THAT(names, ElementsAre("not_finite", "index_out_of_range", "unreferenced_vertices",
                                 "duplicate_faces", "zero_area_faces", "non_manifold_edges",
                                 "non_manifold_vertices", "inconsistent_orientation", "split_border_vertices",
                                 "clamped_edges", "floored_vertices", "flipped_edges"));
}

TEST(CheckMesh, NamesVerticesAtBordersThatCoincide) {
  const TriangleMesh whole = sphere(2), split = split_along_seam(whole);
  const std::int64_t copies = split.vertices.rows() - whole.vertices.rows();
  const MeshReport report = check_mesh(split);
  EXPECT_EQ(report.split_border_vertices.count, 2 * copies);
  EXPECT_EQ(report.split_border_vertices.first.size(), 10u);
  EXPECT_GT(check_mesh(uv_sphere(12, 16)).split_border_vertices.count, 2 * 13)
      << "copies that are apart by rounding";
  EXPECT_EQ(check_mesh(uv_sphere<float>(12, 16)).split_border_vertices.count,
            check_mesh(uv_sphere(12, 16)).split_border_vertices.count)
      << "the same in single precision";
}

TEST(CheckMesh, FindsNoSplitVerticesAtABorderOfItsOwn) {
  for (const TriangleMesh& mesh : {grid(5, 4), sphere(2), welded_uv_sphere()}) {
    EXPECT_EQ(check_mesh(mesh).split_border_vertices.count, 0);
  }
}

TEST(CheckMesh, CountsSplitVerticesOfACubeOfSeparateFaces) {
  const TriangleMesh cube = box_surface(1, 1, 1), split = split_at_every_corner(cube);
  EXPECT_EQ(check_mesh(split).split_border_vertices.count, split.vertices.rows());
  const absl::StatusOr<Weld> weld = weld_by_position(split.vertices);
  ASSERT_TRUE(weld.ok());
  EXPECT_EQ(check_mesh(welded(split, *weld)).split_border_vertices.count, 0);
}

TEST(CheckMesh, FindsNoSplitVerticesWhereClosedPartsTouch) {
  const TriangleMesh cube = box_surface(1, 1, 1);
  const Eigen::Index n = cube.vertices.rows(), m = cube.faces.rows();
  TriangleMesh two{Points(2 * n, 3), Faces(2 * m, 3)};
  two.vertices << cube.vertices, cube.vertices.rowwise() + Eigen::RowVector3d(1, 0, 0);
  two.faces << cube.faces, cube.faces.array() + static_cast<std::int32_t>(n);
  EXPECT_EQ(check_mesh(two).components, 2);
  EXPECT_EQ(check_mesh(two).split_border_vertices.count, 0);
}

TEST(CheckMesh, CountsSplitVerticesWhereOpenPartsTouch) {
  const TriangleMesh two =
      make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}}, {{0, 1, 2}, {3, 4, 5}});
  EXPECT_EQ(check_mesh(two).split_border_vertices.count, 2);
  EXPECT_THAT(check_mesh(two).split_border_vertices.first, ElementsAre(1, 3));
}

TEST(CheckMesh, NamesVerticesThatAreNotFinite) {
  TriangleMesh mesh = make_mesh(kCorners, kTetrahedron);
  mesh.vertices(1, 2) = kNan;
  mesh.vertices(3, 0) = -kInfinity;
  const MeshReport report = check_mesh(mesh);
  EXPECT_EQ(report.not_finite.count, 2);
  EXPECT_THAT(report.not_finite.first, ElementsAre(1, 3));
  EXPECT_EQ(report.zero_area_faces.count, 0) << "the area of a face with NaN is not known to be 0";
  EXPECT_EQ(report.boundary_loops, 0) << "what does not need coordinates is still checked";
  EXPECT_EQ(fault_of(deformable(report)), (Fault{"MESH_NOT_FINITE", "vertex 1", "finite coordinates"}));
}

TEST(CheckMesh, NamesFacesWithIndicesOutOfRange) {
  const MeshReport report = check_mesh(
      make_mesh(kCorners, {{0, 1, 2}, {0, 1, 5}, {1, 2, 3}, {-1, 0, 1}, {4, 2147483647, -2147483647 - 1}}));
  EXPECT_EQ(report.index_out_of_range.count, 3);
  EXPECT_THAT(report.index_out_of_range.first, ElementsAre(1, 3, 4));
  EXPECT_EQ(report.unreferenced_vertices.count, 0);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.edges, 5) << "of the two faces in range";
  EXPECT_EQ(fault_of(deformable(report)), (Fault{"MESH_INDEX_OUT_OF_RANGE", "face 1", "0 <= index < 5"}));
}

TEST(CheckMesh, NamesUnreferencedVertices) {
  const MeshReport report = check_mesh(make_mesh(kCorners, kTetrahedron));
  EXPECT_EQ(report.unreferenced_vertices.count, 1);
  EXPECT_THAT(report.unreferenced_vertices.first, ElementsAre(4));
  EXPECT_EQ(report.components, 1);
  EXPECT_TRUE(deformable(report).ok());
}

TEST(CheckMesh, NamesLaterOnesOfDuplicateFacesInAnyOrderOfCorners) {
  const MeshReport report = check_mesh(make_mesh(kCorners, {{0, 1, 2}, {1, 2, 3}, {2, 1, 0}, {1, 2, 0}}));
  EXPECT_EQ(report.duplicate_faces.count, 2);
  EXPECT_THAT(report.duplicate_faces.first, ElementsAre(2, 3));
  EXPECT_TRUE(deformable(report).ok());
}

TEST(CheckMesh, NamesFacesWithoutArea) {
  const auto mesh = make_mesh({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 0, 0}},
                              {{0, 1, 3}, {0, 1, 2}, {3, 3, 0}, {1, 4, 3}, {2, 2, 2}});
  const MeshReport report = check_mesh(mesh);
  EXPECT_EQ(report.zero_area_faces.count, 4);
  EXPECT_THAT(report.zero_area_faces.first, ElementsAre(1, 2, 3, 4));
  EXPECT_TRUE(deformable(report).ok());
}

TEST(CheckMesh, AThinTriangleStillHasArea) {
  EXPECT_EQ(check_mesh(make_mesh({{0, 0, 0}, {1, 0, 0}, {0.5, 1e-9, 0}}, {{0, 1, 2}})).zero_area_faces.count,
            0);
}

TEST(CheckMesh, FacesWithARepeatedVertexTakeNoPartInEdgeChecks) {
  TriangleMesh mesh = make_mesh(kCorners, kTetrahedron);
  mesh.faces.conservativeResize(6, 3);
  mesh.faces.row(4) << 0, 0, 1;
  mesh.faces.row(5) << 2, 3, 2;
  const MeshReport report = check_mesh(mesh);
  EXPECT_EQ(report.zero_area_faces.count, 2);
  EXPECT_EQ(report.non_manifold_edges.count, 0);
  EXPECT_EQ(report.non_manifold_vertices.count, 0);
  EXPECT_EQ(report.edges, 6);
  EXPECT_EQ(report.boundary_loops, 0);
}

TEST(CheckMesh, NamesEdgesOfMoreThanTwoFacesAndTheirVertices) {
  const MeshReport report = check_mesh(make_mesh(kCorners, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}));
  EXPECT_EQ(report.non_manifold_edges.count, 1);
  EXPECT_THAT(report.non_manifold_edges.first, ElementsAre(0, 1));
  EXPECT_THAT(report.non_manifold_vertices.first, ElementsAre(0, 1));
  EXPECT_EQ(report.inconsistent_orientation.count, 0) << "an edge of three faces has no orientation to keep";
  EXPECT_TRUE(deformable(report).ok());
}

TEST(CheckMesh, NamesVerticesWhereTwoFansMeet) {
  TriangleMesh hourglass = make_mesh({{0, 0, 0}, {1, 0, 1}, {-1, 1, 1}, {-1, -1, 1}, {1, 0, -1}, {-1, 1, -1}},
                                     {{0, 1, 2}, {0, 2, 3}, {0, 4, 5}});
  const MeshReport report = check_mesh(hourglass);
  EXPECT_THAT(report.non_manifold_vertices.first, ElementsAre(0));
  EXPECT_EQ(report.non_manifold_edges.count, 0);
  EXPECT_EQ(report.components, 1);
  EXPECT_EQ(report.boundary_loops, 2);
}

TEST(CheckMesh, NamesEdgesThatTwoFacesRunAlongInTheSameDirection) {
  const MeshReport report = check_mesh(make_mesh(kCorners, {{0, 1, 2}, {0, 1, 3}}));
  EXPECT_EQ(report.inconsistent_orientation.count, 1);
  EXPECT_THAT(report.inconsistent_orientation.first, ElementsAre(0, 1));
  EXPECT_EQ(report.non_manifold_edges.count, 0);
}

TEST(CheckMesh, AMoebiusStripHasOneBoundaryAndASeam) {
  const MeshReport twisted = check_mesh(ring(12, true)), plain = check_mesh(ring(12, false));
  EXPECT_EQ(plain.boundary_loops, 2);
  EXPECT_EQ(plain.inconsistent_orientation.count, 0);
  EXPECT_EQ(twisted.boundary_loops, 1);
  EXPECT_EQ(twisted.inconsistent_orientation.count, 1);
  EXPECT_EQ(twisted.non_manifold_edges.count + twisted.non_manifold_vertices.count, 0);
  EXPECT_TRUE(deformable(twisted).ok());
}

TEST(CheckMesh, CountsBoundaryLoops) {
  TriangleMesh box = box_surface(3, 3, 3);
  box.faces.row(0) = box.faces.row(1);  // opens a hole of one face, doubles another
  EXPECT_EQ(check_mesh(grid(4, 4)).boundary_loops, 1);
  TriangleMesh open = box_surface(4, 4, 4);
  open.faces = Faces(open.faces.bottomRows(open.faces.rows() - 1));
  EXPECT_EQ(check_mesh(open).boundary_loops, 1);
  open.faces = Faces(open.faces.topRows(open.faces.rows() - 1));
  EXPECT_EQ(check_mesh(open).boundary_loops, 2);
}

TEST(CheckMesh, HolesThatTouchAtAVertexAreTwoLoops) {
  // Of the four quarters of a square around its middle, two opposite ones are missing.
  TriangleMesh mesh = grid(4, 4);
  std::vector<std::array<std::int32_t, 3>> kept;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    const Eigen::RowVector3d middle =
        (mesh.vertices.row(mesh.faces(f, 0)) + mesh.vertices.row(mesh.faces(f, 1)) +
         mesh.vertices.row(mesh.faces(f, 2))) /
        3;
    const bool is_hole = (middle[0] > 1 && middle[0] < 2 && middle[1] > 1 && middle[1] < 2) ||
                         (middle[0] > 2 && middle[0] < 3 && middle[1] > 2 && middle[1] < 3);
    if (!is_hole) kept.push_back({mesh.faces(f, 0), mesh.faces(f, 1), mesh.faces(f, 2)});
  }
  std::vector<std::array<double, 3>> vertices;
  for (const auto& row : mesh.vertices.rowwise()) vertices.push_back({row[0], row[1], row[2]});
  const MeshReport report = check_mesh(make_mesh(vertices, kept));
  EXPECT_THAT(report.non_manifold_vertices.first, ElementsAre(12));
  // The two fans at vertex 12 join the holes: going round one of them leads into the other.
  EXPECT_EQ(report.boundary_loops, 2);
}

TEST(CheckMesh, CountsComponentsByEdges) {
  const auto mesh = make_mesh({{9, 9, 9}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}},
                              {{4, 5, 6}, {1, 2, 3}});
  EXPECT_EQ(check_mesh(mesh).components, 2);
  EXPECT_THAT(connected_components(mesh), ElementsAre(-1, 0, 0, 0, 1, 1, 1));
}

TEST(CheckMesh, ShowsTheFirstTenInAscendingOrder) {
  const TriangleMesh open = ring(30, false);
  TriangleMesh mesh{open.vertices, open.faces.replicate(2, 1)};
  const MeshReport report = check_mesh(mesh);
  EXPECT_EQ(report.duplicate_faces.count, 60);
  EXPECT_THAT(report.duplicate_faces.first, ElementsAre(60, 61, 62, 63, 64, 65, 66, 67, 68, 69));
  EXPECT_EQ(report.non_manifold_edges.first.size(), 20u) << "two entries an edge";
}

TEST(CheckMesh, RefusesMeshesWithoutFaces) {
  EXPECT_EQ(fault_of(deformable(check_mesh({}))).reason, "MESH_EMPTY");
  EXPECT_EQ(fault_of(deformable(check_mesh(make_mesh(kCorners, {})))).reason, "MESH_EMPTY");
  EXPECT_EQ(fault_of(deformable(check_mesh(make_mesh({}, {{0, 1, 2}})))).reason, "MESH_EMPTY");
}

TEST(CheckMesh, RefusesMeshesWithoutArea) {
  const auto line = make_mesh({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}}, {{0, 1, 2}, {0, 1, 1}});
  EXPECT_EQ(fault_of(deformable(check_mesh(line))).reason, "MESH_NO_AREA");
}

void expect_same(const MeshReport& a, const MeshReport& b) {
  for (const Defect defect : all_defects()) {
    EXPECT_EQ(a.of(defect).count, b.of(defect).count) << defect_name(defect);
    EXPECT_EQ(a.of(defect).first, b.of(defect).first) << defect_name(defect);
  }
}

/// A bumpy grid with a few faces squeezed flat, in a direction that is not an axis.
TriangleMesh squeezed() {
  TriangleMesh mesh = grid(10, 10, 0.7);
  for (const int f : {3, 50, 120}) {
    const std::int32_t a = mesh.faces(f, 0), b = mesh.faces(f, 1), c = mesh.faces(f, 2);
    mesh.vertices.row(b) = 0.3 * mesh.vertices.row(a) + 0.7 * mesh.vertices.row(c);
  }
  return mesh;
}

TEST(CheckMesh, DoesNotDependOnTheUnitOfLength) {
  const TriangleMesh mesh = squeezed();
  const MeshReport report = check_mesh(mesh);
  EXPECT_GE(report.zero_area_faces.count, 3);
  for (const double scale : {1e-150, 1e-12, 1e-4, 1e4, 1e12, 1e150}) {
    SCOPED_TRACE(scale);
    expect_same(report, check_mesh({scale * mesh.vertices, mesh.faces}));
  }
}

TEST(CheckMesh, DoesNotDependOnTheDistanceFromTheOrigin) {
  const TriangleMesh mesh = squeezed();
  const MeshReport report = check_mesh(mesh);
  for (const double distance : {1e3, 1e6, 1e9}) {
    SCOPED_TRACE(distance);
    const Eigen::RowVector3d shift(distance, -0.7 * distance, 0.3 * distance);
    expect_same(report, check_mesh({mesh.vertices.rowwise() + shift, mesh.faces}));
  }
}

}  // namespace
}  // namespace lpdeform
