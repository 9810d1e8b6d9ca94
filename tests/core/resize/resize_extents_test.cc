#include "core/resize/resize_extents.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <set>

#include "core/resize/resize.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

Eigen::Array3d extent(const Points& positions) {
  return (positions.colwise().maxCoeff() - positions.colwise().minCoeff()).transpose();
}

Points stretched(const TriangleMesh& mesh, int axis, double factor, bool has_locks) {
  const auto shape = rest_shape(mesh);
  Scaling scaling;
  scaling.scale[axis] = factor;
  const ResizeInputs inputs = resize_inputs(ShapeFeatures(shape), scaling).value();
  HandleSet handles;
  EXPECT_TRUE(handles.set("resize", inputs.handle).ok());
  if (has_locks) {
    for (const Handle& lock : side_locks(*shape, scaling.axes, axis))
      EXPECT_TRUE(handles.set(handles.handles().size() == 1 ? "one side" : "other side", lock).ok());
  }
  auto solver = deformer(shape, handles, inputs.material);
  SolveSettings settings;
  settings.initial = InitialGuess::kLaplacian;
  EXPECT_EQ(solver->solve(settings).value().stop_reason, StopReason::kConverged);
  return solver->positions();
}

/// The largest share by which an extent differs from that of the scaled mesh.
double off_by(const TriangleMesh& mesh, int axis, const Points& positions, double factor) {
  Eigen::Array3d wanted = extent(mesh.vertices);
  wanted[axis] *= factor;
  return (extent(positions) / wanted - 1).abs().maxCoeff();
}

TEST(SideLocks, KeepTheExtentAcrossAStretch) {
  for (const TriangleMesh& mesh : {creature(32), pierced_block(32), rocker_arm(32)}) {
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_LT(off_by(mesh, axis, stretched(mesh, axis, 2, true), 2), 0.06)
          << mesh.vertices.rows() << " vertices, axis " << axis;
  }
  // What the ends of the stretched axis alone leave of it.
  EXPECT_GT(off_by(pierced_block(32), 0, stretched(pierced_block(32), 0, 2, false), 2), 0.1);
}

/// Two boxes that lie apart.
TriangleMesh two_boxes() {
  TriangleMesh two = box_surface(4, 4, 6);
  const Eigen::Index n = two.vertices.rows(), m = two.faces.rows();
  two.vertices.conservativeResize(2 * n, 3);
  two.vertices.bottomRows(n) = 0.5 * two.vertices.topRows(n);
  two.vertices.bottomRows(n).rowwise() += Eigen::RowVector3d(9, 0, 2);
  two.faces.conservativeResize(2 * m, 3);
  two.faces.bottomRows(m) = two.faces.topRows(m).array() + static_cast<std::int32_t>(n);
  return two;
}

TEST(SideLocks, HoldEachVertexOnceAndNoneThatTheStretchHolds) {
  const TriangleMesh mesh = two_boxes();
  const auto shape = rest_shape(mesh);
  const Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  const auto held = ends_along(*shape, axes, {false, false, true});
  std::set<std::int32_t> seen(held.begin(), held.end());
  EXPECT_EQ(seen.size(), 2u * 2 * 25);
  const auto locks = side_locks(*shape, axes, 2);
  ASSERT_EQ(locks.size(), 2u);
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_EQ(std::get<PlaneLock>(locks[axis].hold), PlaneLock{Eigen::Vector3d::Unit(axis)});
    std::array<int, 4> at_ends{};
    for (const std::int32_t v : locks[axis].vertices) {
      EXPECT_TRUE(seen.insert(v).second) << v;
      const int component = shape->components()[v];
      const double low = component == 0 ? 0 : 9.0 * (axis == 0), width = component == 0 ? 4 : 2;
      const double share = (mesh.vertices(v, axis) - low) / width;
      EXPECT_TRUE(share == 0 || share == 1) << share;
      ++at_ends[2 * component + (share == 1)];
    }
    for (const int count : at_ends) EXPECT_TRUE(count > 8 && count <= 32) << count;
  }
}

TEST(SideLocks, OfManyComponentsAreNone) {
  TriangleMesh many;
  many.vertices.resize(3 * 241, 3);
  many.faces.resize(241, 3);
  for (int k = 0; k < 241; ++k) {
    many.vertices.row(3 * k) << 2 * k, 0, 0;
    many.vertices.row(3 * k + 1) << 2 * k + 1, 0, 0;
    many.vertices.row(3 * k + 2) << 2 * k, 1, 1;
    many.faces.row(k) << 3 * k, 3 * k + 1, 3 * k + 2;
  }
  EXPECT_TRUE(side_locks(*rest_shape(many), Eigen::Matrix3d::Identity(), 0).empty());
}

TEST(WithExtents, GivesEachComponentItsOwnAlongTurnedAxes) {
  const TriangleMesh mesh = two_boxes();
  const auto shape = rest_shape(mesh);
  const Eigen::Matrix3d turn(Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, -2, 0.5).normalized()));
  const Scaling scaling{.scale = {1, 2, 0.5}, .origin = {3, 1, -4}, .axes = turn.transpose()};
  const Points wanted = scaling(mesh.vertices);
  Points drifted = wanted * 0.9;
  drifted.topRows(mesh.vertices.rows() / 2).rowwise() += Eigen::RowVector3d(1, 2, 3);
  const Points result = with_extents(*shape, scaling.axes, drifted, wanted);
  EXPECT_LT((result - wanted).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(WithExtents, MovesWhatIsFlatAndTakesWhatNoFaceUses) {
  TriangleMesh sheet;
  sheet.vertices.resize(5, 3);
  sheet.vertices << 0, 0, 1, 2, 0, 1, 2, 2, 1, 0, 2, 1, 7, 7, 7;
  sheet.faces.resize(2, 3);
  sheet.faces << 0, 1, 2, 0, 2, 3;
  Points drifted = sheet.vertices;
  drifted.col(2).array() += 0.5;
  const Points result =
      with_extents(*rest_shape(sheet), Eigen::Matrix3d::Identity(), drifted, sheet.vertices);
  EXPECT_LT((result - sheet.vertices).cwiseAbs().maxCoeff(), 1e-15);
}

}  // namespace
}  // namespace lpdeform
