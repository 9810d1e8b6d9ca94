// Solve calls of the running service.

#include <algorithm>
#include <array>
#include <thread>

#include "service_fixture.h"

namespace lpdeform {
namespace {

const Points& rest() {
  static const Points points = bar_mesh().vertices;
  return points;
}

class SolveCallTest : public ServiceTest {
 protected:
  /// Reads until the first progress message.
  static void wait_for_progress(grpc::ClientReader<v1::SolveResponse>& stream) {
    v1::SolveResponse response;
    ASSERT_TRUE(stream.Read(&response));
    ASSERT_TRUE(response.has_progress());
  }

  v1::SolveRequest slow_request(const v1::CreateSessionResponse& session, std::uint64_t input_seq = 1) {
    v1::SolveRequest request = solve_request(session);
    *request.mutable_update() = ends_message(rest(), input_seq, 8);
    solve_slowly(*request.mutable_update());
    request.set_progress(true);
    return request;
  }

  /// Waits until the session has this input, at most for kTestDeadline.
  void wait_for_input(const v1::CreateSessionResponse& session, std::uint64_t input_seq) {
    const auto end = std::chrono::system_clock::now() + kTestDeadline;
    v1::GetSessionRequest request;
    request.set_session(session.session().name());
    v1::GetSessionResponse response;
    do {
      grpc::ClientContext context;
      context.set_deadline(end);
      ASSERT_TRUE(stub_->GetSession(&context, request, &response).ok());
    } while (response.session().input_seq() < input_seq);
  }

  void expect_solves(const v1::CreateSessionResponse& session, std::uint64_t input_seq) {
    v1::SolveRequest request = solve_request(session);
    v1::Update& update = *request.mutable_update();
    update = ends_message(rest(), input_seq, 1);
    update.mutable_settings()->mutable_p()->set_uniform(2);
    update.mutable_settings()->mutable_solver()->set_method(v1::METHOD_QUASI_NEWTON);
    const SolveOutcome outcome = solve(request);
    ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
    EXPECT_EQ(outcome.summary.input_seq(), input_seq);
    EXPECT_EQ(outcome.summary.stop_reason(), v1::STOP_REASON_CONVERGED);
  }
};

class SolveByManualTimeTest : public SolveCallTest {
 protected:
  void SetUp() override {
    timers_ = std::make_shared<ManualTimers>();
    start();
  }
};

TEST_F(SolveCallTest, BringsTheSummaryTheTraceAndTheResultInThatOrder) {
  const auto session = create(bar_mesh());
  v1::SolveRequest request = solve_request(session);
  *request.mutable_update() = ends_message(rest(), 1, 4);
  request.set_scalar(v1::SCALAR_FLOAT64);
  request.set_certify(true);
  request.set_trace(true);
  request.set_progress(true);
  const SolveOutcome outcome = solve(request);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.summary.method(), v1::METHOD_QUASI_NEWTON);
  EXPECT_EQ(outcome.summary.stop_reason(), v1::STOP_REASON_CONVERGED);
  EXPECT_EQ(outcome.summary.input_seq(), 1u);
  EXPECT_LT(outcome.summary.energy(), outcome.summary.initial_energy());
  ASSERT_TRUE(outcome.summary.has_certificate());
  EXPECT_LE(outcome.summary.certificate().relative_gap(), 1e-3);
  ASSERT_EQ(outcome.trace.size(), outcome.summary.iterations() + 1);
  EXPECT_EQ(outcome.trace[0].energy(), outcome.summary.initial_energy());
  ASSERT_TRUE(outcome.frame);
  EXPECT_TRUE(outcome.frame->header.is_final());
  EXPECT_EQ(outcome.frame->header.energy(), outcome.summary.energy());
  const auto tip = static_cast<std::size_t>(vertices_at(rest(), 21)[0]);
  EXPECT_NEAR(outcome.frame->position<double>(tip, 0), rest()(static_cast<Eigen::Index>(tip), 0) + 4, 1e-12);
  const std::string order(outcome.order.begin(), outcome.order.end());
  EXPECT_TRUE(std::is_sorted(order.begin(), order.end(), [](char a, char b) {
    return std::string("pstf").find(a) < std::string("pstf").find(b);
  })) << order;
}

TEST_F(SolveCallTest, ALongTraceComesInParts) {
  const TriangleMesh small = box_surface(3, 3, 15);
  const auto session = create(small);
  v1::SolveRequest request = solve_request(session);
  *request.mutable_update() = ends_message(small.vertices, 1, 8);
  solve_slowly(*request.mutable_update());
  request.mutable_update()->mutable_settings()->mutable_solver()->set_max_iterations(1500);
  request.set_trace(true);
  const SolveOutcome outcome = solve(request);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(outcome.summary.stop_reason(), v1::STOP_REASON_ITERATION_LIMIT);
  EXPECT_EQ(outcome.summary.iterations(), 1500u);
  EXPECT_EQ(std::count(outcome.order.begin(), outcome.order.end(), 't'), 2);
  ASSERT_EQ(outcome.trace.size(), 1501u);
  for (std::uint32_t k = 0; k < 1501; ++k) ASSERT_EQ(outcome.trace[k].iteration(), k);
}

TEST_F(SolveCallTest, GoesOnFromPositionsThatItIsGiven) {
  const auto session = create(bar_mesh());
  v1::SolveRequest request = solve_request(session);
  *request.mutable_update() = ends_message(rest(), 1, 4);
  request.set_scalar(v1::SCALAR_FLOAT64);
  const SolveOutcome first = solve(request);
  ASSERT_TRUE(first.frame);
  const auto other = create(bar_mesh());
  v1::SolveRequest again = solve_request(other);
  *again.mutable_update() = ends_message(rest(), 1, 4);
  again.mutable_initial_positions()->set_scalar(v1::SCALAR_FLOAT64);
  again.mutable_initial_positions()->mutable_data()->set_inline_(first.frame->positions);
  const SolveOutcome second = solve(again);
  ASSERT_TRUE(second.status.ok());
  EXPECT_NEAR(second.summary.initial_energy(), first.summary.energy(), 1e-9 * first.summary.energy());
}

TEST_F(SolveCallTest, NeedsHandles) {
  const auto session = create(bar_mesh());
  const SolveOutcome outcome = solve(solve_request(session));
  EXPECT_EQ(outcome.status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(details_of(outcome.status).info.reason(), "NO_HANDLES");
}

TEST_F(SolveCallTest, ABadUpdateEndsItAndChangesNothing) {
  const auto session = create(bar_mesh());
  v1::SolveRequest request = solve_request(session);
  *request.mutable_update() = ends_message(rest(), 1, 4);
  request.mutable_update()->mutable_settings()->mutable_p()->set_uniform(100);
  const SolveOutcome outcome = solve(request);
  EXPECT_EQ(details_of(outcome.status).info.reason(), "P_OUT_OF_RANGE");
  EXPECT_EQ(details_of(solve(solve_request(session)).status).info.reason(), "NO_HANDLES");
}

TEST_F(SolveByManualTimeTest, SaysThatItIsThereWhereverItHasNothingElseToSay) {
  const auto session = create(bar_mesh());
  v1::SolveRequest request = slow_request(session);
  request.set_progress(false);
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::minutes(1));
  const auto stream = stub_->Solve(&context, request);
  wait_for_input(session, 1);  // the server has the call, and its timer
  v1::SolveResponse response;
  for (int beat = 0; beat < 3; ++beat) {
    timers_->advance(options_.heartbeat / 2);
    timers_->advance(options_.heartbeat / 2);
    ASSERT_TRUE(stream->Read(&response));
    ASSERT_TRUE(response.has_heartbeat()) << response.ShortDebugString();
  }
  timers_->advance(options_.heartbeat / 2);
  const grpc::Status updated = update(session, tip_message(2, 1));
  ASSERT_TRUE(updated.ok()) << updated.error_message();  // ends it
  EXPECT_FALSE(stream->Read(&response)) << response.ShortDebugString();
  EXPECT_EQ(details_of(stream->Finish()).info.reason(), "SUPERSEDED");
}

/// Two threads for all sessions.
class CrowdedSolveTest : public SolveByManualTimeTest {
 protected:
  void SetUp() override {
    options_.runner_threads = 2;
    options_.session_idle = options_.upload_idle = std::chrono::hours(24 * 365);
    SolveByManualTimeTest::SetUp();
  }
};

TEST_F(CrowdedSolveTest, SaysThatItIsThereWhileItWaitsForAThreadAndIsSetUp) {
  const std::jthread clock([this](const std::stop_token& stop) {
    for (; !stop.stop_requested(); std::this_thread::sleep_for(std::chrono::milliseconds(1)))
      timers_->advance(options_.heartbeat);
  });
  const TriangleMesh large = box_surface(40, 40, 160);  // set up in some 100 ms
  bool say_all = false;
  // The clock's thread may get no turn during the set-up.
  for (int tries = 0; tries < 10 && !say_all; ++tries) {
    std::vector<v1::SolveRequest> requests;
    for (int k = 0; k < 3; ++k) {
      requests.push_back(solve_request(create(large)));
      *requests.back().mutable_update() = ends_message(large.vertices, 1, 8);
      requests.back().set_progress(
          true);  // comes with the first iteration: what comes before it comes before the solver
    }
    std::array<grpc::ClientContext, 3> contexts;
    std::vector<std::unique_ptr<grpc::ClientReader<v1::SolveResponse>>> streams;
    for (std::size_t k = 0; k < contexts.size(); ++k) {
      contexts[k].set_deadline(std::chrono::system_clock::now() + kTestDeadline);
      streams.push_back(stub_->Solve(&contexts[k], requests[k]));
    }
    say_all = true;
    for (const auto& stream : streams) {
      v1::SolveResponse response;
      ASSERT_TRUE(stream->Read(&response)) << stream->Finish().error_message();
      say_all = say_all && response.has_heartbeat();
    }
    for (grpc::ClientContext& context : contexts) context.TryCancel();
  }
  EXPECT_TRUE(say_all);
}

TEST_F(SolveCallTest, CancellingLetsTheSessionGoOnWithOtherThings) {
  const auto session = create(bar_mesh());
  grpc::ClientContext context;
  const auto stream = stub_->Solve(&context, slow_request(session));
  wait_for_progress(*stream);
  context.TryCancel();
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  expect_solves(session, 2);
}

TEST_F(SolveCallTest, ADeadlineEndsIt) {
  const auto session = create(bar_mesh());
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::milliseconds(300));
  const SolveOutcome outcome = solve(slow_request(session), &context);
  EXPECT_EQ(outcome.status.error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  expect_solves(session, 2);
}

TEST_F(SolveCallTest, AClientThatGoesAwayEndsIt) {
  const auto session = create(bar_mesh());
  const v1::SolveRequest request = slow_request(session);
  {
    auto gone = connect();
    grpc::ClientContext context;
    const auto stream = gone->Solve(&context, request);
    wait_for_progress(*stream);
    context.TryCancel();
    gone.reset();
  }
  expect_solves(session, 2);
  // Nothing of the lost call is left over that a drain would have to wait for.
  server_->drain(std::chrono::minutes(10));
}

TEST_F(SolveCallTest, ANewerUpdateSupersedesIt) {
  const auto session = create(bar_mesh());
  grpc::ClientContext context;
  const auto stream = stub_->Solve(&context, slow_request(session));
  wait_for_progress(*stream);
  ASSERT_TRUE(update(session, tip_message(2, 1)).ok());
  v1::SolveResponse response;
  while (stream->Read(&response)) {
  }
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::ABORTED);
  EXPECT_EQ(details_of(status).info.reason(), "SUPERSEDED");
}

TEST_F(SolveCallTest, ReadersSeeItsFramesAndItsResult) {
  const auto session = create(bar_mesh());
  DeformClient reader(*stub_, session, {}, false);
  ASSERT_TRUE(reader.next_frame());
  v1::SolveRequest request = slow_request(session);
  request.mutable_update()->mutable_settings()->mutable_solver()->set_max_iterations(200);
  SolveOutcome outcome;
  std::thread solver([&] { outcome = solve(request); });
  const auto frame = reader.settle(1);
  solver.join();
  ASSERT_TRUE(frame);
  ASSERT_TRUE(outcome.status.ok()) << outcome.status.error_message();
  EXPECT_EQ(frame->header.energy(), outcome.summary.energy());
  EXPECT_EQ(frame->header.frame_seq(), outcome.frame->header.frame_seq());
  EXPECT_EQ(frame->header.stop_reason(), v1::STOP_REASON_ITERATION_LIMIT);
  expect_invariants(reader.history, 2);
}

TEST_F(SolveCallTest, MayGoOnWhileTheServerDrainsButNothingNewBegins) {
  const auto session = create(bar_mesh());
  grpc::ClientContext context;
  const auto stream = stub_->Solve(&context, slow_request(session));
  wait_for_progress(*stream);
  DeformClient witness(*stub_, session, {}, false);
  ASSERT_TRUE(witness.next_frame());
  std::thread draining([&] { server_->drain(std::chrono::minutes(10)); });
  EXPECT_TRUE(witness.read_to_end().ok());  // its go-away says that the draining has begun
  v1::GetSessionRequest request;
  v1::GetSessionResponse response;
  grpc::ClientContext refused;
  const grpc::Status status = stub_->GetSession(&refused, request, &response);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
  const ErrorDetails details = details_of(status);
  EXPECT_EQ(details.info.reason(), "DRAINING");
  EXPECT_TRUE(details.retry.has_value());
  v1::SolveResponse progress;
  EXPECT_TRUE(stream->Read(&progress));
  context.TryCancel();
  draining.join();
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(SolveCallTest, IsEndedWhenTheGraceIsOver) {
  const auto session = create(bar_mesh());
  grpc::ClientContext context;
  const auto stream = stub_->Solve(&context, slow_request(session));
  wait_for_progress(*stream);
  server_->drain(std::chrono::milliseconds(0));
  v1::SolveResponse response;
  while (stream->Read(&response)) {
  }
  const auto code = stream->Finish().error_code();
  EXPECT_TRUE(code == grpc::StatusCode::UNAVAILABLE || code == grpc::StatusCode::CANCELLED) << code;
}

}  // namespace
}  // namespace lpdeform
