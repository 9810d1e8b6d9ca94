#include "client/cli/render/scene.h"

#include <gtest/gtest.h>

#include "client/cli/render/corner_normals.h"
#include "client/cli/render/openness.h"
#include "core/shapes/shapes.h"

namespace lpdeform {
namespace {

using Corners = std::array<Eigen::RowVector3d, 3>;

TEST(Raster, TheNearerFaceHidesTheOtherInEitherOrder) {
  const auto triangle = [](double inverse_depth) {
    return Corners{{{0, 0, inverse_depth}, {20, 0, inverse_depth}, {0, 20, inverse_depth}}};
  };
  Raster near_last(10, 10), near_first(10, 10);
  near_last.draw(7, triangle(0.5)), near_last.draw(8, triangle(0.9));
  near_first.draw(8, triangle(0.9)), near_first.draw(7, triangle(0.5));
  EXPECT_EQ(near_last.at(3, 3).face, 8);
  EXPECT_EQ(near_first.at(3, 3).face, 8);
}

TEST(Raster, NeighboursLeaveNoGap) {
  Raster raster(50, 40);
  const Eigen::RowVector3d a(-3, -2, 1), b(61.3, -5, 1), c(57, 48.1, 1), d(-8, 44, 1), middle(23.5, 17.5, 1);
  int face = 0;
  for (const Corners& corners : {Corners{a, b, middle}, {b, c, middle}, {c, d, middle}, {d, a, middle}}) {
    raster.draw(face++, corners);
  }
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 50; ++x) EXPECT_GE(raster.at(x, y).face, 0) << x << " " << y;
  }
}

TEST(Raster, KnowsWhereInsideTheFaceASampleLies) {
  Raster raster(8, 8);
  raster.draw(0, {{{0.5, 0.5, 1}, {8.5, 0.5, 1}, {0.5, 4.5, 1}}});
  EXPECT_FLOAT_EQ(raster.at(2, 1).b, 0.25);
  EXPECT_FLOAT_EQ(raster.at(2, 1).c, 0.25);
  EXPECT_EQ(raster.at(7, 4).face, -1);
}

TEST(Raster, IgnoresTrianglesWithoutArea) {
  Raster raster(4, 4);
  raster.draw(0, {{{0, 0, 1}, {4, 4, 1}, {2, 2, 1}}});
  for (int y = 0; y < 4; ++y) {
    for (int x = 0; x < 4; ++x) EXPECT_EQ(raster.at(x, y).face, -1);
  }
}

TEST(Camera, HoldsEveryPointInsideTheMargins) {
  for (const TriangleMesh& mesh : {box_surface(4, 4, 21), box_surface(30, 2, 3), sphere(2), grid(5, 9)}) {
    const Camera camera(mesh.vertices, 1200, 900);
    double left = 1200, right = 0, top = 900, bottom = 0;
    for (const auto& point : mesh.vertices.rowwise()) {
      const Eigen::RowVector3d at = camera.project(point);
      left = std::min(left, at[0]), right = std::max(right, at[0]);
      top = std::min(top, at[1]), bottom = std::max(bottom, at[1]);
      EXPECT_GT(at[2], 0);
    }
    EXPECT_GE(left, 0.08 * 1200 - 1e-6);
    EXPECT_LE(right, 0.92 * 1200 + 1e-6);
    EXPECT_GE(top, 0.08 * 900 - 1e-6);
    EXPECT_LE(bottom, 0.88 * 900 + 1e-6);
    const bool fills_width = right - left > 0.84 * 1200 - 1e-6,
               fills_height = bottom - top > 0.80 * 900 - 1e-6;
    EXPECT_TRUE(fills_width || fills_height);
  }
}

TEST(Camera, LooksAtTheWidestSideWithZUp) {
  const TriangleMesh mesh = box_surface(20, 4, 10);
  const Camera camera(mesh.vertices, 400, 300);
  const auto along = [&](Eigen::RowVector3d direction) {
    const Eigen::RowVector3d middle(10, 2, 5);
    return Eigen::RowVector3d(camera.project(middle + direction) - camera.project(middle));
  };
  EXPECT_GT(along({1, 0, 0})[0], 0) << "x runs to the right";
  EXPECT_LT(along({0, 0, 1})[1], 0) << "z runs up";
  EXPECT_GT(std::abs(along({1, 0, 0})[0]), std::abs(along({0, 1, 0})[0]))
      << "the side across y faces the camera";
}

TEST(CornerNormals, AreSmoothOnASphere) {
  const TriangleMesh mesh = sphere(3);
  const Points normals = corner_normals(mesh.vertices, mesh.faces);
  for (Eigen::Index corner = 0; corner < normals.rows(); ++corner) {
    // Neighbouring faces of this sphere meet at up to 10 degrees; their mean errs by far less.
    EXPECT_GT(normals.row(corner).dot(mesh.vertices.row(mesh.faces(corner / 3, corner % 3))), std::cos(0.05));
  }
}

TEST(CornerNormals, KeepTheEdgesOfABoxSharp) {
  const TriangleMesh mesh = box_surface(2, 2, 2);
  const Points normals = corner_normals(mesh.vertices, mesh.faces);
  for (const auto& normal : normals.rowwise()) EXPECT_NEAR(normal.cwiseAbs().maxCoeff(), 1, 1e-12);
}

TEST(CornerNormals, AreZeroWithoutArea) {
  const Points positions = Points::Ones(3, 3);
  Faces face(1, 3);
  face << 0, 1, 2;
  EXPECT_EQ(corner_normals(positions, face), Points::Zero(3, 3));
}

TEST(Scene, FoldsAreLessOpenThanFlatParts) {
  // An open book: two squares that meet at a right angle along z.
  Points positions(6, 3);
  positions << 0, 0, 0, 0, 0, 1, 1, 0, 0, 1, 0, 1, 0, -1, 0, 0, -1, 1;
  Faces faces(4, 3);
  faces << 0, 2, 3, 0, 3, 1, 0, 1, 5, 0, 5, 4;
  const Scene book(faces, positions, {}, 300, 300);
  const Openness openness(book, 1, Workers(1));
  double least = 1, most = 0;
  for (int y = 0; y < 300; ++y) {
    for (int x = 0; x < 300; ++x) {
      least = std::min(least, openness.at(x, y));
      most = std::max(most, openness.at(x, y));
    }
  }
  EXPECT_LT(least, 0.9);
  EXPECT_EQ(most, 1);
}

}  // namespace
}  // namespace lpdeform
