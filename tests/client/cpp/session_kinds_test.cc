// Kinds of handles, regions and split meshes through the client library and a real server.

#include "tests/client/session_fixture.h"
#include "tests/core/split_shapes.h"

namespace lpdeform::client {
namespace {

TEST_F(SessionTest, EveryKindOfHandleIsAddedMovedRegroupedAndRemovedLive) {
  const RigidMotion motion{.angle_radians = 0.3, .center = {2, 2, 10.5}, .translation = {0.5, 0, 0}};
  const std::vector<SurfacePoint> points{{100, {0.2, 0.3, 0.5}}, {300, {0.6, 0.2, 0.2}}};
  const std::vector<std::uint32_t> middle = vertices_of("middle");
  const std::vector<Handle> kinds{{middle, motion, Soft{5}},
                                  {{}, motion, Exactly{}, points},
                                  {{}, motion, Soft{50}, points},
                                  {middle, motion, Orientation{}},
                                  {middle, motion, AxisLock{{1, 2, 3}}},
                                  {middle, motion, PlaneLock{{1, 2, 3}}},
                                  {{middle[0]}, motion, Exactly{}, {}, 3.0}};
  Session session = open_bar();
  ASSERT_TRUE(session.remove("middle").ok());
  ASSERT_TRUE(session.settle(kPatience).ok());
  for (const Handle& kind : kinds) {  // each takes the place of the one before
    session.set_handle("kind", kind).value();
    const auto set = session.settle(kPatience);
    ASSERT_TRUE(set.ok()) << kind.hold.index() << ": " << set.status();
    EXPECT_GT(set->energy, 0);
    EXPECT_EQ(set->soft_energy > 0, kind.hold.index() == 1 || kind.hold.index() == 2);
    session.move("kind", RigidMotion{.translation = {0, 0, 0.1}}).value();
    ASSERT_TRUE(session.settle(kPatience).ok());
    const auto solved = session.solve();
    ASSERT_TRUE(solved.ok()) << solved.status();
    EXPECT_EQ(solved->stop_reason, StopReason::kConverged) << kind.hold.index();
  }
  ASSERT_TRUE(session.remove("kind").ok());
  const auto frame = session.settle(kPatience);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_LT(distance(frame->positions, bar().vertices), 1e-2);  // nothing bends it any more
}

TEST_F(SessionTest, ARefusedKindLeavesTheSessionAsItWas) {
  Session session = open_bar();
  const Frame before = session.settle(kPatience).value();
  session.set_handle("bad", {{0}, Fixed{}, AxisLock{{0, 0, 0}}}).value();
  absl::Status refused;
  while (refused.ok()) refused = session.next_frame(kPatience).status();
  EXPECT_EQ(fault_of(refused).reason, "HANDLE_LOCK_DIRECTION");
  const auto solved = session.solve();
  ASSERT_TRUE(solved.ok()) << solved.status();
  EXPECT_NEAR(solved->energy / before.energy, 1, 1e-3);
}

TEST_F(SessionTest, ARegionOfInterestIsSetChangedAndRemovedLive) {
  Session session = open_bar({.double_precision = true});
  const Frame bent = session.settle(kPatience).value();
  std::vector<std::uint32_t> upper;
  const Mesh rest = bar();
  for (std::uint32_t i = 0; i < rest.vertex_count(); ++i) {
    if (rest.vertices[3 * i + 2] >= 8) upper.push_back(i);
  }
  session.set({.region = RegionOfInterest{upper}}).value();
  session.move("middle", twist(60)).value();
  const Frame upper_moved = session.settle(kPatience).value();
  double below = 0, above = 0;
  for (std::uint32_t k = 0; k < rest.vertices.size(); ++k) {
    double& most = rest.vertices[k / 3 * 3 + 2] >= 8 ? above : below;
    most = std::max(most, std::abs(upper_moved.positions[k] - bent.positions[k]));
  }
  EXPECT_EQ(below, 0);
  EXPECT_GT(above, 0.5);
  session.set({.region = RegionOfInterest{}}).value();
  const Frame free = session.settle(kPatience).value();
  session.move("middle", twist(0)).value();
  const Frame still = session.settle(kPatience).value();
  EXPECT_LT(still.energy, 1e-3 * free.energy);
}

TEST_F(SessionTest, KindsComeBackWhenTheSessionIsRecreated) {
  Session session = open_bar();
  session.set_handle("middle", {vertices_of("middle"), twist(90), Soft{0.5}}).value();
  const double energy = session.solve().value().energy;
  server_.stop();
  server_.start_again();
  const auto again = session.solve();
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_NEAR(again->energy / energy, 1, 1e-3);
  EXPECT_GT(again->soft_energy, 0);
}

TEST_F(SessionTest, ASplitMeshIsWeldedAndDrawnWithItsHardEdges) {
  const TriangleMesh split = split_at_every_corner(box_surface(2, 2, 6));
  Mesh mesh = cli::to_client(split);
  mesh.normals = cli::flat(flat_normals(split));
  Session session =
      connect()
          ->open(mesh, {.weld = {.by_position = true}, .double_precision = true, .with_normals = true})
          .value();
  EXPECT_EQ(session.mesh_report().vertices, split.vertices.rows());
  EXPECT_GT(session.mesh_report().welded_vertices, 0);
  Update update;
  std::vector<std::uint32_t> low, high;
  for (Eigen::Index v = 0; v < split.vertices.rows(); ++v) {
    if (split.vertices(v, 2) == 0) low.push_back(static_cast<std::uint32_t>(v));
    if (split.vertices(v, 2) == 6) high.push_back(static_cast<std::uint32_t>(v));
  }
  update.handles.emplace("low", Handle{.vertices = low});
  const RigidMotion turn{.angle_radians = 0.5, .center = {1, 1, 0}};
  update.handles.emplace("high", Handle{.vertices = high, .motion = turn});
  session.update(update).value();
  const Frame frame = session.settle(kPatience).value();
  const SolveResult solved = session.solve({.with_normals = true}).value();
  EXPECT_EQ(frame.normals.size(), mesh.normals.size());
  EXPECT_EQ(solved.normals.size(), mesh.normals.size());
  // The end's own faces are turned about z: their normals stay along it, and those of the sides across it.
  for (const std::uint32_t v : high) {
    const double was = mesh.normals[3 * v + 2], is = solved.normals[3 * v + 2];
    if (was == 1) {
      EXPECT_NEAR(is, 1, 1e-9);
    } else {
      EXPECT_LT(is, 0.5);
    }
  }
  EXPECT_TRUE(session.solve().value().normals.empty());
}

}  // namespace
}  // namespace lpdeform::client
