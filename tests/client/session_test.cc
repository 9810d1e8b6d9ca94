// The client library against a real server in this process.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numbers>

#include "client/cli/generated_shape.h"
#include "client/cli/mesh_input.h"
#include "client/cpp/client.h"
#include "core/mesh/shapes.h"
#include "tests/client/in_process_server.h"
#include "tests/core/split_shapes.h"

namespace lpdeform::client {
namespace {

constexpr std::chrono::seconds kPatience{60};

/// The paper's bar, both ends held, the middle twisted by `degrees`.
class SessionTest : public testing::Test {
 protected:
  static Motion twist(double degrees) {
    return RigidMotion{.angle_radians = degrees * std::numbers::pi / 180, .center = {2, 2, 10.5}};
  }

  static Update bar_handles(double degrees) {
    Update update;
    cli::GeneratedShape shape = cli::generate_shape("bar", 1).value();
    for (cli::NamedHandle& handle : shape.handles) {
      if (handle.name == "middle") handle.handle.motion = twist(degrees);
      update.handles.emplace(std::move(handle.name), std::move(handle.handle));
    }
    return update;
  }

  static std::vector<std::uint32_t> vertices_of(const std::string& name) {
    return std::get<Handle>(bar_handles(0).handles.at(name)).vertices;
  }

  static Mesh bar() { return cli::to_client(box_surface(4, 4, 21)); }

  absl::StatusOr<Client> connect() { return Client::connect(server_.address()); }

  /// A session of the twisted bar.
  Session open_bar(OpenOptions options = {}) {
    Session session = connect()->open(bar(), std::move(options)).value();
    session.update(bar_handles(90)).value();
    return session;
  }

  InProcessServer server_;
};

/// How far two results are apart at most, in one coordinate.
double distance(const std::vector<double>& a, const std::vector<double>& b) {
  double most = a.size() == b.size() ? 0 : INFINITY;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) most = std::max(most, std::abs(a[k] - b[k]));
  return most;
}

TEST_F(SessionTest, SettlesOnAFrameThatMeetsTheHandles) {
  Session session = open_bar();
  EXPECT_EQ(session.mesh_report().vertices, 370);
  const auto frame = session.settle(kPatience);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->stop_reason, StopReason::kConverged);
  EXPECT_EQ(frame->distortion.size(), 370u);
  const Mesh rest = bar();
  for (const std::uint32_t vertex : vertices_of("middle")) {
    const double x = rest.vertices[3 * vertex], y = rest.vertices[3 * vertex + 1];
    EXPECT_NEAR(frame->positions[3 * vertex], 2 - (y - 2), 1e-6);  // float32 of at most 21
    EXPECT_NEAR(frame->positions[3 * vertex + 1], 2 + (x - 2), 1e-6);
  }
}

TEST_F(SessionTest, DraggingGivesTheNewestAndTheLastResultIsTheOneOfADirectSolve) {
  Session session = open_bar();
  std::uint64_t newest = 0, last_seen = 0;
  for (int degrees = 0; degrees <= 60; ++degrees) {
    newest = session.move("middle", twist(degrees)).value();
    const auto frame = session.poll();
    ASSERT_TRUE(frame.ok()) << frame.status();
    if (!frame->has_value()) continue;
    EXPECT_GE((*frame)->input_seq, last_seen);
    last_seen = (*frame)->input_seq;
  }
  const auto dragged = session.settle(kPatience);
  ASSERT_TRUE(dragged.ok()) << dragged.status();
  EXPECT_EQ(dragged->input_seq, newest);

  Session direct = connect()->open(bar()).value();
  direct.update(bar_handles(60)).value();
  const auto solved = direct.solve();
  ASSERT_TRUE(solved.ok()) << solved.status();
  EXPECT_NEAR(dragged->energy / solved->energy, 1, 1e-3);  // both within the tolerance of the same minimum
}

TEST_F(SessionTest, SolveReturnsDoublesATraceAndACertificate) {
  Session session = open_bar();
  int reports = 0;
  const auto solved = session.solve(
      {.certify = true, .keep_trace = true, .on_progress = [&](const SolveProgress&) { ++reports; }});
  ASSERT_TRUE(solved.ok()) << solved.status();
  EXPECT_EQ(solved->stop_reason, StopReason::kConverged);
  EXPECT_EQ(solved->method, "quasi_newton");
  ASSERT_TRUE(solved->optimality_gap.has_value());
  EXPECT_LT(*solved->optimality_gap, 1e-3);
  ASSERT_FALSE(solved->trace.empty());
  EXPECT_EQ(solved->trace.front().energy, solved->initial_energy);
  const Mesh rest = bar();
  for (const std::uint32_t vertex : vertices_of("end_a")) {
    for (int k = 0; k < 3; ++k) EXPECT_EQ(solved->positions[3 * vertex + k], rest.vertices[3 * vertex + k]);
  }
}

TEST_F(SessionTest, SettingsChangeInALiveSession) {
  Session session = open_bar();
  const double at_2 = session.settle(kPatience).value().energy;
  const std::uint64_t changed = session.set({.p = 1.5}).value();
  const Frame frame = session.settle(kPatience).value();
  EXPECT_GE(frame.input_seq, changed);
  Session other = open_bar({.settings = {.p = 1.5}});
  EXPECT_NEAR(frame.energy / other.settle(kPatience).value().energy, 1, 1e-3);
  EXPECT_GT(std::abs(frame.energy / at_2 - 1), 0.1);
}

TEST_F(SessionTest, AMeshThatCannotBeDeformedIsRefusedByItsFirstBadElement) {
  Mesh mesh = bar();
  mesh.vertices[3 * 17 + 1] = NAN;
  const auto session = connect()->open(mesh);
  EXPECT_TRUE(absl::IsInvalidArgument(session.status()));
  EXPECT_EQ(fault_of(session.status()).reason, "MESH_NOT_FINITE");
  EXPECT_EQ(fault_of(session.status()).element, "vertex 17");
}

TEST_F(SessionTest, ARefusedUpdateComesOutOnceAndTheSessionGoesOn) {
  Session session = open_bar();
  ASSERT_TRUE(session.settle(kPatience).ok());
  session.set_handle("bad", {.vertices = {370}}).value();
  absl::Status refused;
  while (refused.ok()) refused = session.next_frame(kPatience).status();
  EXPECT_EQ(fault_of(refused).reason, "HANDLE_VERTEX_OUT_OF_RANGE");
  session.move("middle", twist(45)).value();
  EXPECT_TRUE(session.settle(kPatience).ok());
}

TEST_F(SessionTest, AComponentWithoutAHandleIsNamedUntilItHasOne) {
  Mesh two = bar();
  const auto vertices = two.vertices;
  const auto faces = two.faces;
  for (const double number : vertices) two.vertices.push_back(number + 100);
  for (const std::uint32_t index : faces) two.faces.push_back(index + 370);
  Session session = connect()->open(two).value();
  session.update(bar_handles(90)).value();
  const absl::Status blocked = session.settle(kPatience).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(blocked)) << blocked;
  EXPECT_EQ(fault_of(blocked).reason, "COMPONENT_WITHOUT_HANDLE");
  EXPECT_EQ(fault_of(session.solve().status()).reason, "COMPONENT_WITHOUT_HANDLE");
  session.set_handle("other", {.vertices = {400}}).value();
  EXPECT_TRUE(session.settle(kPatience).ok());
}

TEST_F(SessionTest, AServerThatCameBackWithoutItsSessionsGetsOursAnew) {
  Session session = open_bar({.settings = {.p = 1.5}});
  const Frame before = session.settle(kPatience).value();
  session.set({.stiffness = 2.0}).value();
  const Frame stiff = session.settle(kPatience).value();
  const std::string name = session.name();

  server_.stop();
  server_.start_again();
  absl::StatusOr<Frame> after = absl::UnknownError("");
  do {
    after = session.next_frame(kPatience);
    ASSERT_TRUE(after.ok()) << after.status();
    EXPECT_GE(after->input_seq, stiff.input_seq);
  } while (!after->converged);
  EXPECT_NE(session.name(), name);
  EXPECT_NEAR(after->energy / stiff.energy, 1, 1e-3);
  EXPECT_GT(stiff.energy, 1.5 * before.energy);
  session.move("middle", twist(45)).value();
  EXPECT_LT(session.settle(kPatience).value().energy, stiff.energy);
}

TEST_F(SessionTest, UpdatesMadeWhileTheServerIsAwayArriveWhenItIsBack) {
  Session session = open_bar();
  ASSERT_TRUE(session.settle(kPatience).ok());
  server_.stop();
  for (int degrees = 80; degrees >= 0; degrees -= 10) session.move("middle", twist(degrees)).value();
  server_.start_again();
  const auto settled = session.settle(kPatience);
  ASSERT_TRUE(settled.ok()) << settled.status();
  EXPECT_LT(distance(settled->positions, bar().vertices), 1e-3);  // no twist: at rest, to the tolerance
}

TEST_F(SessionTest, SolveFindsItsSessionLostAndMakesItAnew) {
  Session session = open_bar();
  const double energy = session.solve().value().energy;
  server_.stop();
  server_.start_again();
  const auto again = session.solve();
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_NEAR(again->energy / energy, 1, 1e-3);
}

TEST_F(SessionTest, WithoutAServerItGivesUpAfterAWhile) {
  auto client = Client::connect(server_.address(), {.reconnect_for = std::chrono::milliseconds(200)});
  Session session = client->open(bar()).value();
  session.update(bar_handles(90)).value();
  ASSERT_TRUE(session.settle(kPatience).ok());
  server_.stop();
  absl::Status ended;
  while (ended.ok()) ended = session.next_frame(kPatience).status();
  EXPECT_TRUE(absl::IsUnavailable(ended)) << ended;
  EXPECT_EQ(session.connection(), Connection::kClosed);
}

TEST_F(SessionTest, AReaderSeesTheWritersFramesAndCannotWrite) {
  Session writer = open_bar();
  const Frame written = writer.settle(kPatience).value();
  Session reader = connect()->join(writer.name(), Role::kReader).value();
  const Frame read = reader.settle(kPatience).value();
  EXPECT_EQ(read.positions, written.positions);
  EXPECT_EQ(fault_of(reader.move("middle", Fixed{}).status()).reason, "NOT_THE_WRITER");
}

TEST_F(SessionTest, ANewWriterReplacesTheOldOneWhichCanTakeOverAgain) {
  Session first = open_bar();
  ASSERT_TRUE(first.settle(kPatience).ok());
  Session second = connect()->join(first.name(), Role::kWriter).value();
  second.move("middle", twist(30)).value();
  const Frame theirs = second.settle(kPatience).value();

  absl::Status replaced;
  while (replaced.ok()) replaced = first.next_frame(kPatience).status();
  EXPECT_EQ(fault_of(replaced).reason, "WRITER_REPLACED");
  ASSERT_TRUE(first.take_over().ok());
  first.move("middle", twist(60)).value();
  const auto ours = first.settle(kPatience);
  ASSERT_TRUE(ours.ok()) << ours.status();
  EXPECT_GT(ours->epoch, theirs.epoch);
  EXPECT_GT(ours->energy, theirs.energy);
}

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
    EXPECT_EQ(solved->stop_reason, StopReason::kConverged);
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

TEST_F(SessionTest, KindsComeBackWhenTheSessionIsMadeAnew) {
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

TEST_F(SessionTest, ALargeMeshTravelsInParts) {
  const TriangleMesh large = grid(200, 200, 1.0);  // 40,401 vertices: 1.9 MB
  Session session = connect()->open(cli::to_client(large)).value();
  Update update;
  update.handles.emplace("corner", Handle{{0, 1, 201}});
  update.handles.emplace("lifted", Handle{{40400}, RigidMotion{.translation = {0, 0, 5}}});
  update.settings.p = std::vector<double>(40401, 2.0);
  session.update(std::move(update)).value();
  const auto frame = session.next_frame(kPatience);
  ASSERT_TRUE(frame.ok()) << frame.status();
  EXPECT_EQ(frame->positions.size(), 3u * 40401);
}

TEST_F(SessionTest, CloseDeletesTheSession) {
  Session session = open_bar();
  ASSERT_TRUE(session.settle(kPatience).ok());
  ASSERT_TRUE(session.close().ok());
  EXPECT_TRUE(absl::IsNotFound(connect()->join(session.name(), Role::kReader).status()));
}

TEST_F(SessionTest, NobodyAtTheAddressIsUnavailableAtOnce) {
  const auto client = Client::connect("unix:/nowhere/socket");
  EXPECT_TRUE(absl::IsUnavailable(client.status()));
  EXPECT_EQ(fault_of(client.status()).reason, "NO_SERVER");
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

/// The finished frame of a session that another reads in this encoding.
Frame read_as(absl::StatusOr<Client> client, const Session& session, OpenOptions options) {
  options.with_normals = true;
  Session reader = client->join(session.name(), Role::kReader, std::move(options)).value();
  for (;;) {
    Frame frame = reader.next_frame(kPatience).value();
    if (frame.converged && frame.input_seq > 0) return frame;
  }
}

TEST_F(SessionTest, EncodingsAreOffByHalfAStepAndCompressionByNothing) {
  Session session = open_bar();
  ASSERT_TRUE(session.settle(kPatience).ok());
  const Frame exact = read_as(connect(), session, {.double_precision = true});
  const Frame quantized = read_as(connect(), session, {.encoding = Encoding::kQuantized});
  const Frame compressed = read_as(connect(), session, {.encoding = Encoding::kCompressed});
  ASSERT_EQ(exact.frame_seq, quantized.frame_seq);
  ASSERT_EQ(quantized.positions.size(), exact.positions.size());
  const auto half_a_step = [&](std::size_t axis) {
    double least = 1e300, most = -1e300;
    for (std::size_t k = axis; k < exact.positions.size(); k += 3) {
      least = std::min(least, exact.positions[k]);
      most = std::max(most, exact.positions[k]);
    }
    return (most - least) / 65535 / 2 * (1 + 1e-9);
  };
  for (std::size_t k = 0; k < exact.positions.size(); ++k) {
    EXPECT_NEAR(quantized.positions[k], exact.positions[k], half_a_step(k % 3));
    EXPECT_NEAR(quantized.normals[k], exact.normals[k], 0.5 / 32767 * (1 + 1e-9));
  }
  const double most = *std::ranges::max_element(exact.distortion);
  for (std::size_t k = 0; k < exact.distortion.size(); ++k) {
    EXPECT_NEAR(quantized.distortion[k], exact.distortion[k], most / 65535 / 2 * (1 + 1e-9));
  }
  EXPECT_EQ(compressed.positions, quantized.positions);
  EXPECT_EQ(compressed.distortion, quantized.distortion);
  EXPECT_EQ(compressed.normals, quantized.normals);
}

TEST_F(SessionTest, AFlatMeshIsExactWhenQuantized) {
  const Mesh flat{.vertices = {0, 0, 7, 1, 0, 7, 1, 1, 7, 0, 1, 7}, .faces = {0, 1, 2, 0, 2, 3}};
  Session session = connect()->open(flat, {.encoding = Encoding::kCompressed}).value();
  session.set_handle("all", {.vertices = {0, 1, 2, 3}}).value();
  const auto frame = session.settle(kPatience);
  ASSERT_TRUE(frame.ok());
  EXPECT_EQ(frame->positions, flat.vertices);
}

}  // namespace
}  // namespace lpdeform::client
