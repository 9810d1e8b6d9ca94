#include "core/problem/handles.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/base/fault.h"
#include "core/constraints/constraints.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

/// Two unit boxes, five apart, and a vertex that no face uses.
TriangleMesh two_boxes() {
  const TriangleMesh box = box_surface(1, 1, 1);
  const Eigen::Index n = box.vertices.rows(), m = box.faces.rows();
  TriangleMesh mesh{Points(2 * n + 1, 3), Faces(2 * m, 3)};
  mesh.vertices << box.vertices, box.vertices.rowwise() + Eigen::RowVector3d(5, 0, 0),
      Eigen::RowVector3d(9, 9, 9);
  mesh.faces << box.faces, (box.faces.array() + static_cast<std::int32_t>(n)).matrix();
  return mesh;
}

TEST(Handles, MoveRigidlyRotationFirst) {
  Points rest(1, 3);
  rest << 2, 0, 0;
  const Handle handle{{0}, turn(Eigen::Vector3d(0, 0, 5), 90, {1, 0, 0}, {0, 0, 3})};
  EXPECT_LT((target_positions(handle, rest).row(0) - Eigen::RowVector3d(1, 1, 3)).norm(), 1e-15);
}

TEST(Handles, WithoutMotionStayAtRest) {
  Points rest = Points::Random(4, 3);
  EXPECT_EQ(target_positions({{2, 0}, Fixed{}}, rest).row(0), rest.row(2));
  EXPECT_EQ(target_positions({{2, 0}, Fixed{}}, rest).row(1), rest.row(0));
}

TEST(Handles, RefuseEveryKindOfBadMotionAndStayAsTheyWere) {
  HandleSet handles;
  ASSERT_TRUE(handles.set("a", {{0, 1}, Fixed{}}).ok());
  const HandleSet before = handles;
  const auto reason = [&](HandleMotion motion) {
    return fault_of(handles.set_motion("a", std::move(motion))).reason;
  };
  EXPECT_EQ(reason(RigidMotion{{0, 0, 0}, 1, {0, 0, 0}, {0, 0, 0}}), "HANDLE_AXIS_ZERO");
  EXPECT_EQ(reason(RigidMotion{{0, 0, 1}, kNan, {0, 0, 0}, {0, 0, 0}}), "HANDLE_MOTION_NOT_FINITE");
  EXPECT_EQ(reason(RigidMotion{{0, 0, kNan}, 0, {0, 0, 0}, {0, 0, 0}}), "HANDLE_MOTION_NOT_FINITE");
  EXPECT_EQ(reason(RigidMotion{{0, 0, 1}, 0, {kNan, 0, 0}, {0, 0, 0}}), "HANDLE_MOTION_NOT_FINITE");
  EXPECT_EQ(reason(RigidMotion{{0, 0, 1}, 0, {0, 0, 0}, {0, kNan, 0}}), "HANDLE_MOTION_NOT_FINITE");
  EXPECT_EQ(reason(TargetPositions{Points::Zero(3, 3)}), "HANDLE_TARGET_COUNT");
  EXPECT_EQ(reason(TargetPositions{Points::Constant(2, 3, kNan)}), "HANDLE_MOTION_NOT_FINITE");
  EXPECT_EQ(fault_of(handles.set_motion("b", Fixed{})).reason, "HANDLE_UNKNOWN");
  EXPECT_EQ(fault_of(handles.set("", {{0}, Fixed{}})).reason, "HANDLE_NAME");
  EXPECT_EQ(fault_of(handles.set(std::string(129, 'x'), {{0}, Fixed{}})).reason, "HANDLE_NAME");
  EXPECT_EQ(fault_of(handles.set("c", {{}, Fixed{}})).reason, "HANDLE_EMPTY");
  EXPECT_EQ(handles, before);
}

TEST(Handles, NameAVertexThatIsOutOfRangeOrHeldTwice) {
  HandleSet handles;
  ASSERT_TRUE(handles.set("a", {{0, 9}, Fixed{}}).ok());
  EXPECT_EQ(fault_of(check_handles(handles, 9)),
            (Fault{"HANDLE_VERTEX_OUT_OF_RANGE", "vertex 9", "0 <= vertex < 9"}));
  ASSERT_TRUE(handles.set("b", {{3, 0}, Fixed{}}).ok());
  const absl::Status twice = check_handles(handles, 10);
  EXPECT_EQ(fault_of(twice).reason, "HANDLE_VERTEX_TWICE");
  EXPECT_EQ(twice.message(), "vertex 0 is in handle \"a\" and in handle \"b\"");
  EXPECT_TRUE(handles.remove("b"));
  EXPECT_FALSE(handles.remove("b"));
  EXPECT_TRUE(check_handles(handles, 10).ok());
}

TEST(Constraints, NameTheComponentThatNoHandleHolds) {
  const auto shape = rest_shape(two_boxes());
  HandleSet handles;
  EXPECT_EQ(fault_of(make_constraints(*shape, handles, FreeComponents::kStay).status()).reason, "NO_HANDLES");
  ASSERT_TRUE(handles.set("a", {{0, 1}, Fixed{}}).ok());
  const absl::Status status = make_constraints(*shape, handles, FreeComponents::kError).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(fault_of(status).reason, "COMPONENT_WITHOUT_HANDLE");
  EXPECT_EQ(fault_of(status).element, "component 1");
  EXPECT_NE(status.message().find("vertex 8"), absl::string_view::npos);
}

TEST(Constraints, LetAFreeComponentStayOrFollow) {
  const auto shape = rest_shape(two_boxes());
  HandleSet handles;
  const RigidMotion motion = turn({0, 0, 1}, 90, {0, 0, 0}, {0, 0, 2});
  ASSERT_TRUE(handles.set("a", {{0, 1, 2, 3, 4}, motion}).ok());
  const auto stay = make_constraints(*shape, handles, FreeComponents::kStay).value();
  const auto follow = make_constraints(*shape, handles, FreeComponents::kFollow).value();
  for (std::int32_t i = 8; i < 16; ++i) {
    EXPECT_TRUE(stay.is_held[i] && follow.is_held[i]);
    EXPECT_EQ(stay.targets.row(i), shape->scaled_positions().row(i));
    const Points expected = target_positions({{i}, motion}, shape->positions());
    const Eigen::RowVector3d moved = follow.targets.row(i) * shape->mean_edge_length() + shape->centre();
    EXPECT_LT((moved - expected.row(0)).norm(), 1e-13);
  }
  EXPECT_TRUE(stay.is_held[16]);  // no face uses it
  EXPECT_FALSE(stay.is_held[5]);
}

TEST(Constraints, TurnAFreeComponentWithAHandleWhosePlacesDoNotTellHow) {
  const auto shape = rest_shape(two_boxes());
  const RigidMotion motion = turn({1, 2, 2}, 90, {0, 0, 1}, {0, 0, 2});
  for (const std::vector<std::int32_t>& vertices :
       {std::vector<std::int32_t>{0}, std::vector<std::int32_t>{0, 1}}) {
    HandleSet handles;
    ASSERT_TRUE(handles.set("a", {vertices, motion}).ok());
    const auto follow = make_constraints(*shape, handles, FreeComponents::kFollow).value();
    for (std::int32_t i = 8; i < 16; ++i) {
      const Points expected = target_positions({{i}, motion}, shape->positions());
      const Eigen::RowVector3d moved = follow.targets.row(i) * shape->mean_edge_length() + shape->centre();
      EXPECT_LT((moved - expected.row(0)).norm(), 1e-13) << vertices.size();
    }
  }
}

TEST(Constraints, RefuseTargetsBeyondReason) {
  const auto shape = rest_shape(box_surface(1, 1, 1));
  HandleSet handles;
  ASSERT_TRUE(handles.set("a", {{0}, RigidMotion{{0, 0, 1}, 0, {0, 0, 0}, {1e300, 0, 0}}}).ok());
  EXPECT_EQ(fault_of(make_constraints(*shape, handles, FreeComponents::kError).status()).reason,
            "HANDLE_TARGET_TOO_FAR");
}

TEST(Constraints, FitARigidMotionExactly) {
  const Points from = Points::Random(6, 3);
  const Handle handle{{0, 1, 2, 3, 4, 5}, turn({1, 2, 3}, 70, {1, 0, 0}, {0, 1, 0})};
  const Points to = target_positions(handle, from);
  const RigidTransform fitted = fit_rigid(from, to);
  for (int i = 0; i < 6; ++i) EXPECT_LT((fitted(from.row(i)) - to.row(i)).norm(), 1e-13);
}

}  // namespace
}  // namespace lpdeform
