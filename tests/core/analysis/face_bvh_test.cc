#include "core/analysis/face_bvh.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <random>
#include <vector>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Where a ray meets a triangle (Moeller and Trumbore 1997).
double meeting(const Points& points, const Faces& faces, std::int32_t face, const Eigen::Vector3d& origin,
               const Eigen::Vector3d& direction) {
  const Eigen::Vector3d a = points.row(faces(face, 0)), b = points.row(faces(face, 1)),
                        c = points.row(faces(face, 2));
  const Eigen::Vector3d p = direction.cross(c - a), from = origin - a, q = from.cross(b - a);
  const double determinant = p.dot(b - a);
  const double u = from.dot(p) / determinant, v = direction.dot(q) / determinant,
               t = (c - a).dot(q) / determinant;
  return determinant != 0 && u >= 0 && v >= 0 && u + v <= 1 && t >= 0 ? t : kInfinity;
}

void expect_the_nearest(const TriangleMesh& mesh, const Eigen::Vector3d& origin,
                        const Eigen::Vector3d& direction, const FaceBvh& tree) {
  double least = kInfinity;
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f)
    least =
        std::min(least, meeting(mesh.vertices, mesh.faces, static_cast<std::int32_t>(f), origin, direction));
  const double found = tree.nearest(origin, direction, 1e-9, [&](std::int32_t k) {
    return meeting(mesh.vertices, mesh.faces, tree.order()[k], origin, direction);
  });
  EXPECT_EQ(found, least) << origin.transpose() << " to " << direction.transpose();
}

TEST(FaceBvh, FindsTheFirstFaceAlongARay) {
  TriangleMesh mesh = box_surface(5, 6, 7);
  mesh.vertices = shaken(mesh.vertices, 0.4);
  const FaceBvh tree(mesh.vertices, mesh.faces);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1, 1);
  for (int k = 0; k < 500; ++k) {
    const Eigen::Vector3d origin(2.5 + 4 * number(random), 3 + 5 * number(random), 3.5 + 6 * number(random));
    expect_the_nearest(mesh, origin, Eigen::Vector3d(number(random), number(random), number(random)), tree);
  }
}

TEST(FaceBvh, FindsWhatLiesAlongTheAxes) {
  const TriangleMesh mesh = box_surface(5, 6, 7);  // rays within the planes of boxes, and on their borders
  const FaceBvh tree(mesh.vertices, mesh.faces);
  for (const double at : {0.0, 0.5, 2.0, 2.25, 5.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      for (const double sign : {1.0, -1.0}) {
        expect_the_nearest(mesh, {at, at, at}, sign * Eigen::Vector3d::Unit(axis), tree);
        expect_the_nearest(mesh, {at, 1.5, 2.5}, sign * Eigen::Vector3d::Unit(axis), tree);
      }
    }
  }
}

TEST(FaceBvh, OfNoFacesOrOneIsATreeToo) {
  TriangleMesh mesh = grid(1, 1);
  const FaceBvh none(mesh.vertices, Faces(0, 3));
  EXPECT_EQ(none.nearest({0, 0, 1}, {0, 0, -1}, 1e-9, [](std::int32_t) { return 0.0; }), kInfinity);
  mesh.faces.conservativeResize(1, 3);
  const FaceBvh one(mesh.vertices, mesh.faces);
  EXPECT_EQ(one.order(), std::vector<std::int32_t>{0});
  const Eigen::Vector3d middle = (mesh.vertices.row(mesh.faces(0, 0)) + mesh.vertices.row(mesh.faces(0, 1)) +
                                  mesh.vertices.row(mesh.faces(0, 2))) /
                                 3;
  expect_the_nearest(mesh, middle + Eigen::Vector3d::UnitZ(), -Eigen::Vector3d::UnitZ(), one);
}

TEST(FaceBvh, KeepsFacesWithOneCentreApart) {
  TriangleMesh mesh = grid(1, 1);
  const Faces twice = mesh.faces;
  mesh.faces.resize(40 * twice.rows(), 3);
  for (int k = 0; k < 40; ++k) mesh.faces.middleRows(k * twice.rows(), twice.rows()) = twice;
  const FaceBvh tree(mesh.vertices, mesh.faces);
  std::vector<std::int32_t> order = tree.order();
  std::ranges::sort(order);
  for (std::size_t k = 0; k < order.size(); ++k) EXPECT_EQ(order[k], static_cast<std::int32_t>(k));
}

}  // namespace
}  // namespace lpdeform
