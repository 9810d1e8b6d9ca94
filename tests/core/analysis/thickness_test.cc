#include "core/analysis/thickness.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>

#include "core/analysis/face_geometry.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

const Workers kOne(1);

/// The nearest exit of the ray behind `face`, by looking at every triangle; far from edges of triangles.
double by_looking_at_all(const RestShape& shape, Eigen::Index face) {
  const FaceGeometry from = face_geometry(shape, face);
  double nearest = std::numeric_limits<double>::infinity();
  for (Eigen::Index f = 0; f < shape.faces().rows(); ++f) {
    const FaceGeometry other = face_geometry(shape, f);
    const double along = -from.normal.dot(other.normal);
    if (f == face || !(along > 0.5)) continue;
    const double t = (other.centre - from.centre).dot(other.normal) / along;
    const Eigen::RowVector3d hit = from.centre - t * from.normal;
    bool is_inside = t > 0;
    for (int k = 0; k < 3; ++k) {
      const Eigen::RowVector3d a = shape.scaled_positions().row(shape.faces()(f, k));
      const Eigen::RowVector3d b = shape.scaled_positions().row(shape.faces()(f, (k + 1) % 3));
      is_inside = is_inside && (b - a).cross(hit - a).dot(other.normal) >= 0;
    }
    if (is_inside) nearest = std::min(nearest, t);
  }
  return nearest;
}

TEST(Thickness, OfABoxIsTheDistanceOfItsSides) {
  const auto shape = rest_shape(box_surface(3, 4, 5));
  const std::vector<double> thickness = thickness_behind_faces(*shape, kOne);
  for (Eigen::Index f = 0; f < shape->faces().rows(); ++f) {
    Eigen::Index axis = 0;
    face_geometry(*shape, f).normal.cwiseAbs().maxCoeff(&axis);
    EXPECT_NEAR(thickness[f] * shape->mean_edge_length(), 3.0 + static_cast<double>(axis), 1e-9) << f;
  }
}

TEST(Thickness, AgreesWithLookingAtEveryTriangle) {
  const auto shape = rest_shape(creature(32));
  const std::vector<double> thickness = thickness_behind_faces(*shape, kOne);
  int known = 0;
  for (Eigen::Index f = 0; f < shape->faces().rows(); ++f) {
    const double expected = by_looking_at_all(*shape, f);
    EXPECT_EQ(std::isinf(thickness[f]), std::isinf(expected)) << f;
    if (std::isinf(expected)) continue;
    EXPECT_NEAR(thickness[f], std::max(expected, 0.5), 1e-9) << f;
    ++known;
  }
  EXPECT_GT(known, 0.9 * static_cast<double>(thickness.size()));
}

TEST(Thickness, IsTheSameInsideOut) {
  TriangleMesh mesh = creature(24);
  const std::vector<double> before = thickness_behind_faces(*rest_shape(mesh), kOne);
  mesh.faces.col(1).swap(mesh.faces.col(2));
  const std::vector<double> after = thickness_behind_faces(*rest_shape(mesh), kOne);
  for (std::size_t f = 0; f < before.size(); ++f) {
    EXPECT_TRUE(before[f] == after[f] || std::abs(before[f] - after[f]) < 1e-9) << f;  // or both infinite
  }
}

TEST(Thickness, IsInfiniteWhereTheSurfaceEnclosesNothing) {
  for (const double t : thickness_behind_faces(*rest_shape(grid(4, 4)), kOne)) EXPECT_TRUE(std::isinf(t));
}

TEST(Thickness, OfDoubledFacesIsThinAndNotZero) {
  TriangleMesh mesh = grid(3, 3);
  const Faces front = mesh.faces;
  mesh.faces.resize(2 * front.rows(), 3);
  mesh.faces << front, front.rowwise().reverse();
  for (const double t : thickness_behind_faces(*rest_shape(mesh), kOne)) EXPECT_EQ(t, 0.5);
}

TEST(Thickness, HasTheSameBitsOnTwoThreads) {
  const auto shape = rest_shape(creature(32));
  EXPECT_EQ(thickness_behind_faces(*shape, kOne), thickness_behind_faces(*shape, Workers(2)));
}

}  // namespace
}  // namespace lpdeform
