// The service with large meshes and many clients at the same time.

#include <atomic>
#include <thread>

#include "service_fixture.h"

namespace lpdeform {
namespace {

class LoadTest : public ServiceTest {};

/// Holds two opposite edges of a grid; shifts one of them by z.
v1::Update grid_update(const Points& points, std::uint64_t input_seq, double z) {
  v1::Update update;
  update.set_input_seq(input_seq);
  std::vector<std::int32_t> left, right;
  const double end = points.col(0).maxCoeff();
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    if (points(i, 0) == 0) left.push_back(static_cast<std::int32_t>(i));
    if (points(i, 0) == end) right.push_back(static_cast<std::int32_t>(i));
  }
  set_handle(update, "left", left, 0);
  set_handle(update, "right", right, 0);
  update.mutable_handles(1)->mutable_set()->mutable_motion()->mutable_rigid()->mutable_translation()->set_z(
      z);
  return update;
}

TEST_F(LoadTest, HalfAMillionVerticesTravelInPartsThroughDefaultLimits) {
  const TriangleMesh mesh = grid(999, 499);
  const auto n = static_cast<std::size_t>(mesh.vertices.rows());
  ASSERT_EQ(n, 500'000u);
  const auto session = create(mesh);
  EXPECT_EQ(session.session().mesh().vertices(), 500'000);

  // Everything is held, each vertex at a place of its own: the messages are long, and there is nothing to
  // minimise.
  std::vector<std::int32_t> all(n);
  for (std::size_t i = 0; i < n; ++i) all[i] = static_cast<std::int32_t>(i);
  Points targets = mesh.vertices;
  targets.col(2).array() += 0.25 * targets.col(0).array();
  const std::vector<double> p(n, 1.5);
  v1::SolveRequest request = solve_request(session);
  request.set_scalar(v1::SCALAR_FLOAT64);
  v1::Update& update = *request.mutable_update();
  update.set_input_seq(1);
  v1::HandleUpdate& handle = *update.add_handles();
  handle.set_name("all");
  handle.mutable_set()->mutable_vertices()->set_upload(upload(packed(all)));
  v1::TargetPositions& motion = *handle.mutable_set()->mutable_motion()->mutable_targets();
  motion.set_scalar(v1::SCALAR_FLOAT64);
  motion.mutable_positions()->set_upload(upload(packed(targets)));
  v1::FieldValues& field = *update.mutable_settings()->mutable_p()->mutable_per_vertex();
  field.set_scalar(v1::SCALAR_FLOAT64);
  field.mutable_values()->set_upload(
      upload({reinterpret_cast<const char*>(p.data()), p.size() * sizeof(double)}));
  update.mutable_settings()->mutable_solver()->set_max_iterations(1);
  const SolveOutcome outcome = solve(request);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  ASSERT_TRUE(outcome.frame);
  EXPECT_GT(outcome.frame->parts, 10);
  EXPECT_EQ(outcome.frame->positions.size(), n * 24);
  EXPECT_EQ(outcome.frame->distortion.size(), n * 8);
  for (std::size_t i = 0; i < n; i += 9973) {
    ASSERT_NEAR(outcome.frame->position<double>(i, 2), targets(static_cast<Eigen::Index>(i), 2), 1e-9) << i;
  }

  DeformClient reader(*stub_, session, {}, false);
  const auto frame = reader.next_frame();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->positions.size(), n * 12);
  EXPECT_EQ(frame->header.input_seq(), 1u);
}

TEST_F(LoadTest, TwoSessionsAtOnceBothMakeProgress) {
  const auto a = create(bar_mesh()), b = create(bar_mesh());
  DeformClient first(*stub_, a), second(*stub_, b);
  for (DeformClient* const client : {&first, &second}) {
    v1::Update update = ends_message(bar_mesh().vertices, 1, 8);
    solve_slowly(update);
    ASSERT_TRUE(client->send(update));
  }
  for (DeformClient* const client : {&first, &second, &first, &second}) {
    std::uint32_t iteration = 0;
    for (int frames = 0; frames < 10;) {
      const auto frame = client->next_frame();
      ASSERT_TRUE(frame);
      ASSERT_FALSE(frame->header.is_final() && frame->header.input_seq() == 1);
      if (frame->header.iteration() > iteration) ++frames;
      iteration = std::max(iteration, frame->header.iteration());
    }
  }
}

TEST_F(LoadTest, ASmallMeshKeepsItsRateBesideALargeOne) {
  const TriangleMesh large_mesh = grid(399, 249, 1.0);
  ASSERT_EQ(large_mesh.vertices.rows(), 100'000);
  const auto large = create(large_mesh), small = create(bar_mesh());
  DeformClient large_client(*stub_, large, {}, true), small_client(*stub_, small);
  ASSERT_TRUE(large_client.next_frame());
  v1::Update update = grid_update(large_mesh.vertices, 1, 80);
  solve_slowly(update);
  ASSERT_TRUE(large_client.send(update));
  while (large_client.history.results.empty()) ASSERT_TRUE(large_client.read());

  // The large session has only begun to factor. Were the small one's updates to wait for the large one's slices,
  // there would be one answer a slice, and an iteration of the large one is a slice of its own.
  constexpr std::uint32_t kIterations = 20;
  std::atomic<std::uint32_t> large_iteration = 0;
  std::atomic<bool> is_over = false;
  std::jthread watching([&] {
    while (large_iteration < kIterations) {
      const auto frame = large_client.next_frame();
      if (!frame) break;
      large_iteration = frame->header.iteration();
    }
    is_over = true;
  });
  ASSERT_TRUE(small_client.send(ends_message(bar_mesh().vertices, 1, 0)));
  std::uint64_t seq = 1;
  while (!is_over) {
    ASSERT_TRUE(small_client.send(tip_message(seq + 1, 0.05 * static_cast<double>(seq % 40))));
    ASSERT_TRUE(small_client.settle(++seq));
  }
  watching.join();
  EXPECT_GE(large_iteration, kIterations);
  EXPECT_GE(seq, 3 * kIterations);
  for (const auto& frame : large_client.history.frames) {
    EXPECT_FALSE(frame.input_seq() == 1 && frame.is_final());  // it was at work all the time
  }
}

TEST_F(LoadTest, StreamsAreToldOfOverloadAndOfItsEnd) {
  const auto told = [](DeformClient& client, v1::NoticeReason reason) {
    while (const auto response = client.read()) {
      const v1::StreamEvent& event = response->event();
      if (event.has_notice() && event.notice().reason() == reason) return !event.notice().text().empty();
      if (event.has_frame() && event.frame().last()) client.acknowledge(event.frame().frame_seq());
    }
    return false;
  };
  // More sessions that are never done than there are threads: each waits for all the others' slices.
  std::vector<v1::CreateSessionResponse> sessions;
  std::vector<std::unique_ptr<DeformClient>> clients;
  for (int k = 0; k < 64; ++k) {
    sessions.push_back(create(bar_mesh()));
    clients.push_back(std::make_unique<DeformClient>(*stub_, sessions.back()));
    v1::Update update = ends_message(bar_mesh().vertices, 1, 8);
    solve_slowly(update);
    ASSERT_TRUE(clients.back()->send(update));
  }
  EXPECT_TRUE(told(*clients.front(), v1::NOTICE_REASON_OVERLOADED));
  EXPECT_TRUE(told(*clients.back(), v1::NOTICE_REASON_OVERLOADED));
  clients.resize(1);  // without readers the others rest
  EXPECT_TRUE(told(*clients.front(), v1::NOTICE_REASON_RECOVERED));
}

TEST_F(LoadTest, AClientThatReadsNothingGetsTheNewestFrameWhenItResumes) {
  const TriangleMesh mesh = grid(79, 49);
  const auto session = create(mesh);
  DeformClient sleeper(*stub_, session), reader(*stub_, session, {}, false);
  std::uint64_t seq = 0;
  while (seq < 8) {
    ++seq;
    ASSERT_TRUE(update(session, grid_update(mesh.vertices, seq, 0.1 * double(seq))).ok());
    ASSERT_TRUE(reader.settle(seq));
  }
  // What is on its way to the sleeper is bounded by its credit of 2; the one after that is the newest.
  std::optional<ReceivedFrame> frame;
  do {
    frame = sleeper.next_frame();
    ASSERT_TRUE(frame);
  } while (frame->header.input_seq() < seq);
  EXPECT_TRUE(frame->header.is_final());
  EXPECT_LE(sleeper.history.frames.size(), 3u);
  expect_invariants(sleeper.history, 2);
  expect_invariants(reader.history, 2);
}

TEST_F(LoadTest, ShutsDownUnderLoadAndEveryStreamEndsOnce) {
  constexpr int kClients = 6;
  std::vector<std::thread> clients;
  std::atomic<int> at_work = 0;
  std::vector<History> histories(kClients);
  for (int k = 0; k < kClients; ++k) {
    clients.emplace_back([&, k] {
      const auto stub = connect();
      const auto session = create(bar_mesh());
      DeformClient client(*stub, session);
      client.send(ends_message(bar_mesh().vertices, 1, 1));
      std::uint64_t seq = 1;
      while (client.next_frame()) {
        ++seq;
        if (seq == 5) ++at_work;
        client.send(tip_message(seq, 0.01 * static_cast<double>(seq)));
      }
      client.read_to_end();
      histories[static_cast<std::size_t>(k)] = client.history;
    });
  }
  while (at_work < kClients) std::this_thread::yield();
  server_->drain(std::chrono::seconds(60));
  for (std::thread& client : clients) client.join();
  for (const History& history : histories) {
    ASSERT_EQ(history.ends.size(), 1u);
    EXPECT_EQ(history.ends[0].reason(), v1::GO_AWAY_REASON_DRAINING);
    expect_invariants(history, 2);
  }
}

}  // namespace
}  // namespace lpdeform
