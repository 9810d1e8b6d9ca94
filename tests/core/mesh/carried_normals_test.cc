#include "core/mesh/carried_normals.h"

#include "tests/core/mesh_support.h"
#include "tests/core/split_shapes.h"

namespace lpdeform {
namespace {

/// Of a split mesh, welded by position.
CarriedNormals normals_of(const TriangleMesh& split, const Points& rest_normals = Points(0, 3)) {
  return {split.faces, split.vertices, weld_by_position(split.vertices).value(), rest_normals};
}

Eigen::Matrix3d some_turn() {
  return Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
}

double degrees_between(const Eigen::RowVector3d& a, const Eigen::RowVector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / EIGEN_PI;
}

TEST(CarriedNormals, OfABoxesCornerDoNotDependOnItsTriangles) {
  const TriangleMesh box = box_surface(1, 1, 1);
  const Points normals = normals_of(box).at(box.vertices);
  for (Eigen::Index v = 0; v < 8; ++v) {
    const Eigen::RowVector3d outwards = 2 * box.vertices.row(v) - Eigen::RowVector3d(1, 1, 1);
    EXPECT_LT((normals.row(v) - outwards.normalized()).norm(), 1e-14);
  }
}

TEST(CarriedNormals, ShowNoTextureSeamOnASphere) {
  const TriangleMesh mesh = sphere(3), split = split_along_seam(mesh);
  ASSERT_GT(split.vertices.rows(), mesh.vertices.rows() + 20);
  const Weld weld = weld_by_position(split.vertices).value();
  const Points drawn = split.vertices.rowwise().normalized();  // as a modelling program would give them
  for (const Points& rest_normals : {Points(0, 3), drawn}) {
    const CarriedNormals carried = normals_of(split, rest_normals);
    for (const Points& pose : {split.vertices, bent_along_z(split.vertices, 0.8)}) {
      const Points normals = carried.at(pose);
      for (std::int32_t v = 0; v < weld.split_count(); ++v) {
        const std::int32_t first = weld.first_copy[weld.to_welded[v]];
        EXPECT_TRUE(same_bits(normals.row(v), normals.row(first))) << "copies " << first << " and " << v;
      }
    }
    // And the seam's are those of the sphere that was never cut.
    const Points whole = normals_of(mesh).at(mesh.vertices);
    const Points normals = carried.at(split.vertices);
    for (std::int32_t v = 0; v < weld.split_count(); ++v)
      EXPECT_LT(degrees_between(normals.row(v), whole.row(weld.to_welded[v])), 1.0);
  }
}

TEST(CarriedNormals, KeepABoxesHardEdgesHard) {
  const TriangleMesh split = split_at_every_corner(box_surface(4, 4, 12));
  const Weld weld = weld_by_position(split.vertices).value();
  const Points rest = flat_normals(split);
  const CarriedNormals carried = normals_of(split, rest);
  const Points pose = bent_along_z(split.vertices, 0.1);
  const Points normals = carried.at(pose);
  TriangleMesh posed = split;
  posed.vertices = pose;
  const Points faces = flat_normals(posed);
  int hard = 0;
  for (std::int32_t v = 0; v < weld.split_count(); ++v) {
    EXPECT_LT(degrees_between(normals.row(v), faces.row(v)), 8) << "it follows its own side";
    const std::int32_t first = weld.first_copy[weld.to_welded[v]];
    const double was = degrees_between(rest.row(v), rest.row(first));
    const double is = degrees_between(normals.row(v), normals.row(first));
    EXPECT_NEAR(is, was, 8);
    if (was > 80) ++hard;
    if (rest.row(v) == rest.row(first)) {
      EXPECT_EQ(normals.row(v), normals.row(first)) << "inside a side nothing shows";
    }
  }
  EXPECT_GT(hard, 100);
}

TEST(CarriedNormals, WithoutRestNormalsAreSmoothOverABoxesEdges) {
  const TriangleMesh split = split_at_every_corner(box_surface(2, 2, 2));
  const Weld weld = weld_by_position(split.vertices).value();
  const Points normals = normals_of(split).at(split.vertices);
  for (std::int32_t v = 0; v < weld.split_count(); ++v)
    EXPECT_TRUE(same_bits(normals.row(v), normals.row(weld.first_copy[weld.to_welded[v]])));
}

TEST(CarriedNormals, AtRestAreThoseGivenAndTurnWithTheSurface) {
  // Normals that lean away from the surface's by some 15 degrees, of any length.
  const TriangleMesh split = split_along_seam(sphere(2));
  Points given = 3.0 * split.vertices;
  given.col(0).array() += 0.8;
  const CarriedNormals carried = normals_of(split, given);
  const Points expected = given.rowwise().normalized();
  EXPECT_LT((carried.at(split.vertices) - expected).cwiseAbs().maxCoeff(), 1e-13);
  const Points moved = 40.0 * split.vertices * some_turn().transpose();
  EXPECT_LT((carried.at(moved) - expected * some_turn().transpose()).cwiseAbs().maxCoeff(), 1e-13);
}

TEST(CarriedNormals, OfLengthZeroAskForTheSmoothOne) {
  const TriangleMesh split = split_along_seam(sphere(2));
  const Points smooth = normals_of(split).at(split.vertices);
  const Points asked = normals_of(split, Points::Zero(split.vertices.rows(), 3)).at(split.vertices);
  EXPECT_LT((asked - smooth).cwiseAbs().maxCoeff(), 1e-14);
}

TEST(CarriedNormals, AreFiniteWhereFacesHaveNoArea) {
  // A vertex that no face uses, one with a zero-area face only, and a shape pressed into a line and a point.
  TriangleMesh mesh = make_mesh({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5, 0, 0}, {9, 9, 9}, {1, 1, 0}},
                                {{0, 1, 2}, {0, 3, 1}, {0, 0, 5}});
  Points given = Points::Zero(6, 3);
  given.row(4) << 0, 2, 0;
  given.row(3) << 0, 0, -1;
  const Points normals = normals_of(mesh, given).at(mesh.vertices);
  EXPECT_EQ(normals.row(4), Eigen::RowVector3d(0, 1, 0)) << "as given";
  EXPECT_EQ(normals.row(3), Eigen::RowVector3d(0, 0, -1));
  EXPECT_EQ(normals.row(5), Eigen::RowVector3d(0, 0, 0));
  for (const double flatness : {1.0, 0.0}) {
    Points pressed = Points::Zero(6, 3);
    pressed.col(0) = flatness * mesh.vertices.col(0);
    EXPECT_TRUE(normals_of(mesh, given).at(pressed).allFinite());
    EXPECT_TRUE(normals_of(mesh).at(pressed).isZero(0));
  }
}

}  // namespace
}  // namespace lpdeform
