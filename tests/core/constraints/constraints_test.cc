#include "core/constraints/constraints.h"

#include <gtest/gtest.h>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

/// Two separate triangles and a vertex that no face has.
class ConstraintsTest : public testing::Test {
 protected:
  static TriangleMesh two_triangles() {
    TriangleMesh mesh;
    mesh.vertices.resize(7, 3);
    mesh.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 3, 1, 0, 3, 0, 1, 3, 5, 6, 7;
    mesh.faces.resize(2, 3);
    mesh.faces << 0, 1, 2, 3, 4, 5;
    return mesh;
  }
  Constraints made(const HandleSet& handles, FreeComponents free_components,
                   const Points* outside = nullptr) const {
    return make_constraints(*shape, handles, free_components, outside).value();
  }
  /// Each held position of a vertex with faces is also the target, but for its unit and rounding.
  void expect_consistent(const Constraints& constraints) const {
    std::size_t held = 0;
    for (const char is_held : constraints.is_held) held += is_held != 0 ? 1 : 0;
    ASSERT_EQ(constraints.exact.vertices.size(), held);
    for (const std::int32_t i : constraints.exact.vertices) {
      EXPECT_TRUE(constraints.is_held[i]) << i;
      if (shape->components()[i] < 0) continue;
      const Eigen::RowVector3d target =
          constraints.targets.row(i) * shape->mean_edge_length() + shape->centre();
      EXPECT_LE((constraints.exact.of(i) - target).norm(), 1e-12) << i;
    }
  }
  static Handle at(std::int32_t vertex, const Eigen::RowVector3d& to) {
    return {{vertex}, TargetPositions{Points(to)}};
  }

  const TriangleMesh mesh = two_triangles();
  const std::shared_ptr<const RestShape> shape = rest_shape(mesh);
};

TEST_F(ConstraintsTest, HeldPositionsAreThoseGivenInOrderOfVertices) {
  HandleSet handles;
  (void)handles.set("a", at(4, {1.1, 0.1, 3.1}));
  (void)handles.set("b", at(1, {0.7, 0.2, 0.3}));
  const Constraints constraints = made(handles, FreeComponents::kError);
  expect_consistent(constraints);
  EXPECT_EQ(constraints.exact.vertices, (std::vector<std::int32_t>{1, 4, 6}));
  EXPECT_EQ(constraints.exact.of(1), Eigen::RowVector3d(0.7, 0.2, 0.3));
  EXPECT_EQ(constraints.exact.of(4), Eigen::RowVector3d(1.1, 0.1, 3.1));
  EXPECT_EQ(constraints.exact.of(6), mesh.vertices.row(6));
}

TEST_F(ConstraintsTest, AHandleMovesAVertexWithoutFaces) {
  HandleSet handles;
  (void)handles.set("a", at(0, {0, 0, 0}));
  (void)handles.set("b", at(3, {0, 0, 3}));
  (void)handles.set("lone", at(6, {8, 8, 8}));
  const Constraints constraints = made(handles, FreeComponents::kError);
  expect_consistent(constraints);
  EXPECT_EQ(constraints.exact.of(6), Eigen::RowVector3d(8, 8, 8));
}

TEST_F(ConstraintsTest, WhatIsOutsideTheRegionStaysWhereItWas) {
  HandleSet handles;
  (void)handles.set("a", at(0, {0, 0, 0.5}));
  (void)handles.set("b", at(2, {9, 9, 9}));
  (void)handles.set_region(std::vector<std::int32_t>{0, 1});
  Points outside = mesh.vertices;
  outside.row(4) << 2, 2, 2;
  outside.row(6) << 3, 3, 3;
  const Constraints constraints = made(handles, FreeComponents::kError, &outside);
  expect_consistent(constraints);
  EXPECT_EQ(constraints.exact.vertices, (std::vector<std::int32_t>{0, 2, 3, 4, 5, 6}));
  EXPECT_EQ(constraints.exact.of(0), Eigen::RowVector3d(0, 0, 0.5));
  EXPECT_EQ(constraints.exact.of(2), mesh.vertices.row(2));
  EXPECT_EQ(constraints.exact.of(4), Eigen::RowVector3d(2, 2, 2));
  EXPECT_EQ(constraints.exact.of(6), mesh.vertices.row(6));
}

TEST_F(ConstraintsTest, FreeComponentsStayOrFollow) {
  HandleSet handles;
  (void)handles.set("a", at(0, {0, 0, 0.5}));
  const Constraints staying = made(handles, FreeComponents::kStay);
  expect_consistent(staying);
  EXPECT_EQ(staying.exact.of(4), mesh.vertices.row(4));
  const Constraints following = made(handles, FreeComponents::kFollow);
  expect_consistent(following);
  EXPECT_LE((following.exact.of(4) - Eigen::RowVector3d(1, 0, 3.5)).norm(), 1e-12);
}

}  // namespace
}  // namespace lpdeform
