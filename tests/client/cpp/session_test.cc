// The client library against a real server in this process.

#include "tests/client/session_fixture.h"

namespace lpdeform::client {
namespace {

/// Waits without taking frames.
Notice awaited_notice(const Session& session) {
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!session.notice() && std::chrono::steady_clock::now() < end) {
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return session.notice().value_or(Notice{});
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

class BentBarTest : public SessionTest {
 protected:
  /// One end turned by 80 degrees. The first minimum that the solver comes to is 2.8 % above another one.
  Session open_bent(MinimaSearch search) {
    const Mesh mesh = cli::to_client(box_surface(6, 6, 40));
    const auto end = [&mesh](double z) {
      Handle out;
      for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) {
        if (mesh.vertices[3 * v + 2] == z) out.vertices.push_back(v);
      }
      return out;
    };
    search.least_share = 0.001;
    Update update;
    update.settings = {.p = 1.5, .solver = SolverSettings{.search = search}};
    update.handles["bottom"] = end(0);
    update.handles["top"] = end(40);
    std::get<Handle>(update.handles["top"]).motion =
        RigidMotion{.axis = {1, 0, 0}, .angle_radians = 80 * std::numbers::pi / 180, .center = {3, 3, 20}};
    Session session = connect()->open(mesh).value();
    session.update(update).value();
    return session;
  }
};

TEST_F(BentBarTest, ASessionInWhichNothingChangesAnnouncesABetterShapeWhichIsTakenOnce) {
  Session session = open_bent({.effort = 2});
  const Frame first = session.settle(kPatience).value();
  const Notice notice = awaited_notice(session);
  ASSERT_EQ(notice.reason, Notice::Reason::kBetterShape);
  EXPECT_EQ(notice.input_seq, first.input_seq);
  EXPECT_NEAR(notice.saved_share, 1 - notice.energy / first.energy, 1e-12);
  const BetterShape taken = session.take_better_shape().value();
  EXPECT_EQ(taken.energy, notice.energy);
  EXPECT_FALSE(session.notice());
  const Frame shown = session.next_frame(kPatience).value();
  EXPECT_TRUE(shown.is_final);
  EXPECT_EQ(shown.input_seq, first.input_seq);
  EXPECT_EQ(shown.energy, notice.energy);
  EXPECT_EQ(fault_of(session.take_better_shape().status()).reason, "NO_BETTER_SHAPE");
}

TEST_F(BentBarTest, ASolveSaysWhichMinimaItHasSeen) {
  Session session = open_bent({.effort = 1});
  const SolveResult lowest = session.solve().value();
  EXPECT_EQ(lowest.further_starts, 12u);
  EXPECT_EQ(lowest.energy, std::ranges::min(lowest.minima));
  EXPECT_EQ(fault_of(session.take_better_shape().status()).reason, "NO_BETTER_SHAPE");
}

TEST_F(SessionTest, AResultComesAgainWithItsGapWhereItWasAskedFor) {
  Session session = open_bar({.certify = true});
  const Frame first = session.settle(kPatience).value();
  const Frame again = first.optimality_gap ? first : session.next_frame(kPatience).value();
  ASSERT_TRUE(again.optimality_gap.has_value());
  EXPECT_LT(*again.optimality_gap, 1e-4);
  EXPECT_TRUE(again.is_final);
  EXPECT_EQ(again.input_seq, first.input_seq);
  EXPECT_EQ(again.positions, first.positions);

  const std::uint64_t moved = session.move("middle", twist(80)).value();
  Frame frame;
  do {
    frame = session.next_frame(kPatience).value();
    const bool is_result = frame.is_final && frame.input_seq == moved;
    EXPECT_TRUE(is_result || !frame.optimality_gap.has_value());
  } while (!frame.optimality_gap);
  EXPECT_EQ(frame.input_seq, moved);
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

TEST_F(SessionTest, AServerThatCameBackWithoutItsSessionsGetsOursAgain) {
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
  } while (!after->is_final);
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

TEST_F(SessionTest, SolveFindsItsSessionLostAndRecreatesIt) {
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

/// The finished frame of a session that another reads in this encoding.
Frame read_as(absl::StatusOr<Client> client, const Session& session, OpenOptions options) {
  options.with_normals = true;
  Session reader = client->join(session.name(), Role::kReader, std::move(options)).value();
  for (;;) {
    Frame frame = reader.next_frame(kPatience).value();
    if (frame.is_final && frame.input_seq > 0) return frame;
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

TEST_F(SessionTest, UndoTakesADragBackAndRedoDoesItAgain) {
  Session session = open_bar();
  const auto first = session.settle(kPatience);
  ASSERT_TRUE(first.ok()) << first.status();
  session.update({.handles = {{"middle", twist(60)}}, .begins_step = true}).value();
  session.move("middle", twist(30)).value();
  const auto dragged = session.settle(kPatience);
  ASSERT_TRUE(dragged.ok()) << dragged.status();
  ASSERT_TRUE(session.undo().ok());
  const auto back = session.settle(kPatience);
  ASSERT_TRUE(back.ok()) << back.status();
  EXPECT_LT(distance(back->positions, first->positions), 1e-2);
  EXPECT_GT(distance(dragged->positions, first->positions), 1);
  ASSERT_TRUE(session.redo().ok());
  const auto again = session.settle(kPatience);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_LT(distance(again->positions, dragged->positions), 1e-2);
  EXPECT_EQ(fault_of(session.redo().status()).reason, "NOTHING_TO_REDO");
  EXPECT_TRUE(session.move("middle", twist(10)).ok());
  EXPECT_TRUE(session.settle(kPatience).ok());
}

TEST_F(SessionTest, ASnapshotMakesTheSameSessionOnAnotherServer) {
  Session session = open_bar({.double_precision = true});
  const auto frame = session.settle(kPatience);
  ASSERT_TRUE(frame.ok()) << frame.status();
  const auto file = connect()->snapshot(session.name());
  ASSERT_TRUE(file.ok()) << file.status();
  InProcessServer elsewhere;
  const auto other = Client::connect(elsewhere.address());
  auto client = *other;
  const auto name = client.restore(*file);
  ASSERT_TRUE(name.ok()) << name.status();
  Session copy = client.join(*name, Role::kWriter, {.double_precision = true}).value();
  const auto first = copy.next_frame(kPatience);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_LT(distance(first->positions, frame->positions), 1e-3);  // or already a step further
  EXPECT_TRUE(copy.move("middle", twist(20)).ok());
  EXPECT_TRUE(copy.settle(kPatience).ok());
  EXPECT_EQ(fault_of(client.restore("nothing of the kind").status()).reason, "SNAPSHOT_FOREIGN");
  EXPECT_EQ(fault_of(client.snapshot("sessions/none").status()).reason, "SESSION_UNKNOWN");
  EXPECT_TRUE(copy.close().ok());
  Session opened = client.open_snapshot(session.snapshot().value()).value();
  EXPECT_TRUE(opened.move("middle", twist(20)).ok());
  EXPECT_TRUE(opened.settle(kPatience).ok());
  const std::string opened_name = opened.name();
  EXPECT_TRUE(opened.close().ok());  // which deletes it, since it was made here
  EXPECT_EQ(fault_of(client.snapshot(opened_name).status()).reason, "SESSION_UNKNOWN");
  EXPECT_EQ(fault_of(client.open_snapshot("nothing of the kind").status()).reason, "SNAPSHOT_FOREIGN");
  EXPECT_EQ(fault_of(opened.snapshot().status()).reason, "SESSION_CLOSED");
  EXPECT_TRUE(client.remove(*name).ok());
  EXPECT_EQ(fault_of(client.snapshot(*name).status()).reason, "SESSION_UNKNOWN");
}

}  // namespace
}  // namespace lpdeform::client
