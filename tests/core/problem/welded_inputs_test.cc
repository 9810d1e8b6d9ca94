#include "core/problem/welded_inputs.h"

#include <gmock/gmock.h>

#include "core/base/fault.h"
#include "tests/core/poses.h"
#include "tests/core/split_shapes.h"

namespace lpdeform {
namespace {

using testing::ElementsAre;

/// Vertices 0 and 2 are copies of one, so are 1 and 4.
Weld some_weld() {
  Points points(5, 3);
  points << 0, 0, 0, 1, 0, 0, 0, 0, 0, 2, 0, 0, 1, 0, 0;
  return weld_by_position(points).value();
}

HandleSet one_handle(Handle handle) {
  HandleSet handles;
  EXPECT_TRUE(handles.set("a", std::move(handle)).ok());
  return handles;
}

TEST(WeldedInputs, AHandleHoldsTheVertexWhicheverCopyItNames) {
  const HandleSet handles = welded(one_handle({{4, 3, 1}}), some_weld()).value();
  EXPECT_THAT(handles.handles().at("a").vertices, ElementsAre(1, 2));
}

TEST(WeldedInputs, TargetsFollowTheirVertices) {
  Points targets(3, 3);
  targets << 7, 7, 7, 8, 8, 8, 7, 7, 7;
  const HandleSet handles = welded(one_handle({{4, 3, 1}, TargetPositions{targets}}), some_weld()).value();
  EXPECT_EQ(std::get<TargetPositions>(handles.handles().at("a").motion).positions, targets.topRows(2));
  targets(2, 1) = 7 + 1e-15;
  EXPECT_TRUE(welded(one_handle({{4, 3, 1}, TargetPositions{targets}}), some_weld()).ok());
  targets(2, 1) = 7.001;
  const Fault fault =
      fault_of(welded(one_handle({{4, 3, 1}, TargetPositions{targets}}), some_weld()).status());
  EXPECT_EQ(fault.reason, "COPIES_DIFFER");
  EXPECT_EQ(fault.element, "vertex 1");
}

TEST(WeldedInputs, TwoHandlesMayNotHoldCopiesOfOneVertex) {
  HandleSet handles = one_handle({{0, 3}});
  ASSERT_TRUE(handles.set("b", {{1, 2}}).ok());
  const absl::Status status = welded(handles, some_weld()).status();
  EXPECT_EQ(fault_of(status).reason, "HANDLE_VERTEX_TWICE");
  EXPECT_EQ(fault_of(status).element, "vertex 2");
  EXPECT_THAT(std::string(status.message()), testing::HasSubstr("vertex 0 is in handle \"a\""));
}

TEST(WeldedInputs, CopiesHaveOnePAndOneStiffness) {
  Material material = Material::uniform(1.5);
  material.stiffness.resize(5);
  material.stiffness << 1, 2, 1, 3, 2;
  const Material merged = welded(material, some_weld()).value();
  EXPECT_EQ(merged.p.size(), 1);
  EXPECT_THAT(std::vector<double>(merged.stiffness.begin(), merged.stiffness.end()), ElementsAre(1, 2, 3));
  material.p = material.stiffness;
  material.p[4] = 2.5;
  EXPECT_EQ(fault_of(welded(material, some_weld()).status()).reason, "COPIES_DIFFER");
  EXPECT_EQ(fault_of(welded(material, some_weld()).status()).element, "vertex 4");
}

TEST(WeldedInputs, CopiesHaveOnePosition) {
  Points points(5, 3);
  points << 1, 1, 1, 2, 2, 2, 1, 1, 1, 3, 3, 3, 2, 2, 2;
  EXPECT_EQ(welded(points, some_weld(), "positions")->col(0), Eigen::Vector3d(1, 2, 3));
  points(2, 2) += 1e-16;
  EXPECT_TRUE(welded(points, some_weld(), "positions").ok()) << "the same place up to rounding";
  points(2, 2) = 5;
  EXPECT_EQ(fault_of(welded(points, some_weld(), "positions").status()).reason, "COPIES_DIFFER");
}

TEST(WeldedInputs, ASplitMeshIsDeformedLikeTheWholeOne) {
  const TriangleMesh bar = box_surface(3, 3, 8), split = split_at_every_corner(bar);
  const Weld weld = weld_by_position(split.vertices).value();
  const auto handles_of = [](const TriangleMesh& mesh) {
    HandleSet handles;
    EXPECT_TRUE(handles.set("low", {slice(mesh, 2, 0, 0)}).ok());
    EXPECT_TRUE(
        handles.set("high", {slice(mesh, 2, 8, 8), turn(Eigen::Vector3d::UnitX(), 50, {1.5, 1.5, 4})}).ok());
    return handles;
  };
  const auto solved = [](const TriangleMesh& mesh, const HandleSet& handles) {
    auto one = deformer(rest_shape(mesh), handles, Material::uniform(2));
    EXPECT_EQ(one->solve({})->stop_reason, StopReason::kConverged);
    return one->positions();
  };
  const Points whole = solved(bar, handles_of(bar));
  const Points pieces = scattered(solved(welded(split, weld), welded(handles_of(split), weld).value()), weld);
  for (Eigen::Index corner = 0; corner < pieces.rows(); ++corner)
    EXPECT_LT((pieces.row(corner) - whole.row(bar.faces(corner / 3, corner % 3))).norm(), 1e-3);
}

}  // namespace
}  // namespace lpdeform
