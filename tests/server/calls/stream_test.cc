// Streams of frames of the running service: Deform, and StreamFrames with UpdateHandles and AckFrames.

#include <cmath>
#include <functional>
#include <thread>

#include "service_fixture.h"

namespace lpdeform {
namespace {

const Points& rest() {
  static const Points points = bar_mesh().vertices;
  return points;
}

v1::FrameOptions with_credit(std::uint32_t credit) {
  v1::FrameOptions options;
  options.set_credit(credit);
  return options;
}

class StreamTest : public ServiceTest {};

TEST_F(StreamTest, DeformAnswersEveryUpdateAndEndsWithTheConvergedFrameOfTheLast) {
  const auto session = create(bar_mesh());
  DeformClient client(*stub_, session);
  ASSERT_TRUE(client.send(ends_message(rest(), 1, 1)));
  for (std::uint64_t seq = 2; seq <= 20; ++seq) ASSERT_TRUE(client.send(tip_message(seq, 0.2 * double(seq))));
  const auto frame = client.settle(20);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->header.input_seq(), 20u);
  EXPECT_EQ(frame->header.stop_reason(), v1::STOP_REASON_CONVERGED);
  EXPECT_EQ(frame->header.method(), v1::METHOD_QUASI_NEWTON);
  EXPECT_GT(frame->header.energy(), 0);
  const auto tip = static_cast<std::size_t>(vertices_at(rest(), 21)[0]);
  EXPECT_NEAR(frame->position<float>(tip, 0), rest()(static_cast<Eigen::Index>(tip), 0) + 4, 1e-5);
  EXPECT_EQ(frame->distortion.size(), 370u * 4);
  while (client.history.results.size() < 20 && client.read()) {
  }
  for (std::uint64_t k = 0; k < 20; ++k) EXPECT_EQ(client.history.results[k].input_seq(), k + 1);
  expect_invariants(client.history, 2);
}

TEST_F(StreamTest, EveryInputIsAnsweredOrCountedAsSkipped) {
  const auto session = create(bar_mesh());
  DeformClient client(*stub_, session, with_credit(8));
  ASSERT_TRUE(client.next_frame());  // the state before the first input
  ASSERT_TRUE(client.send(ends_message(rest(), 1, 1)));
  for (std::uint64_t seq = 2; seq <= 30; ++seq) ASSERT_TRUE(client.send(tip_message(seq, 0.1 * double(seq))));
  ASSERT_TRUE(client.settle(30));
  std::uint64_t answered = 0, skipped = 0;
  for (std::size_t k = 1; k < client.history.frames.size(); ++k) {
    const auto &before = client.history.frames[k - 1], &after = client.history.frames[k];
    if (after.input_seq() != before.input_seq()) ++answered;
    skipped += after.skipped_inputs();
  }
  EXPECT_EQ(answered + skipped, 30u);
}

TEST_F(StreamTest, ASlowReaderGetsNothingBeyondItsCreditAndThenTheNewest) {
  const auto session = create(bar_mesh());
  DeformClient client(*stub_, session, with_credit(1));
  const auto first = client.next_frame(false);
  ASSERT_TRUE(first);
  EXPECT_EQ(first->header.input_seq(), 0u);
  // A second reader tells when the solver is done with all of it.
  DeformClient watcher(*stub_, session, with_credit(8), false);
  ASSERT_TRUE(client.send(ends_message(rest(), 1, 1)));
  for (std::uint64_t seq = 2; seq <= 10; ++seq) ASSERT_TRUE(client.send(tip_message(seq, double(seq))));
  ASSERT_TRUE(watcher.settle(10));
  while (client.history.results.size() < 10) ASSERT_TRUE(client.read());
  EXPECT_EQ(client.history.frames.size(), 1u);
  ASSERT_TRUE(client.acknowledge(first->header.frame_seq()));
  const auto next = client.next_frame(false);
  ASSERT_TRUE(next);
  EXPECT_EQ(next->header.input_seq(), 10u);
  EXPECT_TRUE(next->header.is_final());
  EXPECT_EQ(next->header.skipped_inputs(), 9u);
  expect_invariants(client.history, 1);
}

TEST_F(StreamTest, UnaryCallsAndAFrameStreamDoWhatDeformDoes) {
  const auto session = create(bar_mesh());
  grpc::ClientContext context;
  v1::StreamFramesRequest request;
  request.set_session(session.session().name());
  *request.mutable_options() = with_credit(1);
  const auto stream = stub_->StreamFrames(&context, request);
  v1::StreamFramesResponse response;
  ASSERT_TRUE(stream->Read(&response));
  ASSERT_TRUE(response.event().has_opened());
  const v1::StreamOpened opened = response.event().opened();
  EXPECT_EQ(opened.vertex_count(), 370u);
  EXPECT_EQ(opened.options().credit(), 1u);
  EXPECT_EQ(opened.options().scalar(), v1::SCALAR_FLOAT32);
  ASSERT_TRUE(update(session, ends_message(rest(), 1, 2)).ok());
  for (bool is_answered = false; !is_answered;) {
    ASSERT_TRUE(stream->Read(&response));
    if (response.event().has_notice()) continue;  // a notice that the server has much to do
    ASSERT_TRUE(response.event().has_frame());
    const v1::FrameHeader& header = response.event().frame().header();
    is_answered = header.input_seq() == 1 && header.is_final();
    v1::AckFramesRequest ack;
    ack.set_session(session.session().name());
    ack.set_stream_id(opened.stream_id());
    ack.set_frame_seq(header.frame_seq());
    v1::AckFramesResponse nothing;
    grpc::ClientContext ack_context;
    ASSERT_TRUE(stub_->AckFrames(&ack_context, ack, &nothing).ok());
  }
  context.TryCancel();
  while (stream->Read(&response)) {
  }
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
}

TEST_F(StreamTest, FramesComeAsAskedFor) {
  const auto session = create(bar_mesh());
  v1::FrameOptions options;
  options.set_scalar(v1::SCALAR_FLOAT64);
  options.set_without_distortion(true);
  DeformClient client(*stub_, session, options);
  ASSERT_TRUE(client.send(ends_message(rest(), 1, 0.1)));
  const auto frame = client.settle(1);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->header.scalar(), v1::SCALAR_FLOAT64);
  EXPECT_TRUE(frame->distortion.empty());
  const auto tip = static_cast<std::size_t>(vertices_at(rest(), 21)[0]);
  EXPECT_NEAR(frame->position<double>(tip, 0), rest()(static_cast<Eigen::Index>(tip), 0) + 0.1, 1e-12);
}

TEST_F(StreamTest, ABadUpdateIsAFaultOfItsOwnAndTheStreamGoesOn) {
  const auto session = create(bar_mesh());
  DeformClient client(*stub_, session);
  ASSERT_TRUE(client.send(ends_message(rest(), 1, 1)));
  v1::Update bad = tip_message(2, 5);
  set_handle(bad, "third", {5, 5}, 0);
  ASSERT_TRUE(client.send(bad));
  ASSERT_TRUE(client.send(tip_message(3, 2)));
  ASSERT_TRUE(client.settle(3));
  ASSERT_EQ(client.history.faults.size(), 1u);
  const v1::Fault& fault = client.history.faults[0];
  EXPECT_EQ(fault.input_seq(), 2u);
  EXPECT_EQ(fault.code(), static_cast<int>(grpc::StatusCode::INVALID_ARGUMENT));
  EXPECT_EQ(fault.reason(), "HANDLE_VERTEX_TWICE");
  EXPECT_EQ(fault.element(), "vertex 5");
  EXPECT_FALSE(fault.text().empty());
}

TEST_F(StreamTest, AReadersUpdatesAreRefused) {
  const auto session = create(bar_mesh());
  DeformClient reader(*stub_, session, {}, false);
  ASSERT_TRUE(reader.send(tip_message(1, 1)));
  while (reader.history.faults.empty()) ASSERT_TRUE(reader.read());
  EXPECT_EQ(reader.history.faults[0].reason(), "WRITER_TOKEN_MISSING");
}

TEST_F(StreamTest, AComponentWithoutAHandleIsAFaultOnEveryStreamUntilItHasOne) {
  const auto session = create(two_bars_mesh());
  DeformClient writer(*stub_, session), reader(*stub_, session, {}, false);
  v1::Update one;
  one.set_input_seq(1);
  set_handle(one, "left", {0, 1, 2}, 1);
  ASSERT_TRUE(writer.send(one));
  for (DeformClient* const client : {&writer, &reader}) {
    while (client->history.faults.empty()) ASSERT_TRUE(client->read());
    EXPECT_EQ(client->history.faults[0].reason(), "COMPONENT_WITHOUT_HANDLE");
    EXPECT_EQ(client->history.faults[0].code(), static_cast<int>(grpc::StatusCode::FAILED_PRECONDITION));
    EXPECT_EQ(client->history.faults[0].input_seq(), 1u);
    EXPECT_FALSE(client->history.faults[0].element().empty());
  }
  EXPECT_EQ(solve(solve_request(session)).status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  // Who comes later sees the present state, and hears of it too.
  DeformClient late(*stub_, session, {}, false);
  while (late.history.faults.empty()) ASSERT_TRUE(late.read());
  EXPECT_EQ(late.history.frames.size(), 1u);
  v1::Update other;
  other.set_input_seq(2);
  set_handle(other, "right", {static_cast<std::int32_t>(two_bars_mesh().vertices.rows() - 1)}, 0);
  ASSERT_TRUE(writer.send(other));
  EXPECT_TRUE(writer.settle(2));
}

TEST_F(StreamTest, MethodPFieldAndStiffnessChangeInALiveSession) {
  const auto session = create(bar_mesh());
  DeformClient client(*stub_, session);
  ASSERT_TRUE(client.send(ends_message(rest(), 1, 3)));
  const auto first = client.settle(1);
  ASSERT_TRUE(first);
  v1::Update second = tip_message(2, 3);
  std::vector<double> p(370, 2.0), stiffness(370, 1.0);
  for (std::size_t i = 0; i < 180; ++i) p[i] = 1.5;
  stiffness[5] = 20;
  const auto bytes = [](const std::vector<double>& values) {
    return std::string(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(double));
  };
  v1::FieldValues& field = *second.mutable_settings()->mutable_p()->mutable_per_vertex();
  field.set_scalar(v1::SCALAR_FLOAT64);
  field.mutable_values()->set_inline_(bytes(p));
  v1::FieldValues& weights = *second.mutable_settings()->mutable_stiffness()->mutable_per_vertex();
  weights.set_scalar(v1::SCALAR_FLOAT64);
  weights.mutable_values()->set_inline_(bytes(stiffness));
  second.mutable_settings()->mutable_length_unit()->set_length(0.5);
  ASSERT_TRUE(client.send(second));
  const auto mixed = client.settle(2);
  ASSERT_TRUE(mixed);
  EXPECT_NE(mixed->header.energy(), first->header.energy());
  v1::Update third;
  third.set_input_seq(3);
  third.mutable_settings()->mutable_p()->set_uniform(2);
  third.mutable_settings()->mutable_stiffness()->set_uniform(1);
  third.mutable_settings()->mutable_solver()->set_method(v1::METHOD_LOCAL_GLOBAL);
  third.mutable_settings()->mutable_solver()->set_tolerance(1e-8);
  ASSERT_TRUE(client.send(third));
  const auto again = client.settle(3);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->header.method(), v1::METHOD_LOCAL_GLOBAL);
  EXPECT_NEAR(again->header.energy(), first->header.energy(), 0.02 * first->header.energy());
}

TEST_F(StreamTest, MessagesAgainstTheContractEndTheStreamWithThatReason) {
  const auto session = create(bar_mesh());
  const std::vector<std::function<void(DeformClient&)>> offences = {
      [](DeformClient& client) { client.acknowledge(1000); },
      [](DeformClient& client) { client.write(v1::DeformRequest()); },
      [&](DeformClient& client) {
        v1::DeformRequest again;
        again.mutable_open()->set_session(session.session().name());
        client.write(again);
      },
      [](DeformClient& client) {  // what cannot be parsed, since texts are UTF-8
        v1::Update update;
        update.set_input_seq(1);
        update.add_handles()->set_name("tip \xff");
        client.send(update);
      }};
  for (const auto& offend : offences) {
    DeformClient client(*stub_, session);
    ASSERT_TRUE(client.next_frame(false));
    offend(client);
    EXPECT_TRUE(client.read_to_end().ok());
    ASSERT_EQ(client.history.ends.size(), 1u);
    EXPECT_EQ(client.history.ends[0].reason(), v1::GO_AWAY_REASON_PROTOCOL_ERROR);
    expect_invariants(client.history, 2);
  }
}

TEST_F(StreamTest, AStreamThatIsNeverOpenedIsInvalid) {
  grpc::ClientContext context;
  const auto stream = stub_->Deform(&context);
  v1::DeformRequest request;
  *request.mutable_update() = tip_message(1, 1);
  stream->Write(request);
  v1::DeformResponse response;
  EXPECT_FALSE(stream->Read(&response));
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT);
  EXPECT_EQ(details_of(status).info.reason(), "STREAM_PROTOCOL");
}

TEST_F(StreamTest, AFirstMessageThatCannotBeParsedIsInvalid) {
  grpc::ClientContext context;
  const auto stream = stub_->Deform(&context);
  v1::DeformRequest request;
  request.mutable_open()->set_session("sessions/\xff");
  stream->Write(request);
  v1::DeformResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(details_of(stream->Finish()).info.reason(), "STREAM_PROTOCOL");
}

TEST_F(StreamTest, WrongOptionsAreInvalid) {
  const auto session = create(bar_mesh());
  v1::FrameOptions rate;
  rate.set_max_frames_per_second(std::nan(""));
  DeformClient too_much(*stub_, session, with_credit(9)), strange(*stub_, session, rate);
  EXPECT_EQ(details_of(too_much.read_to_end()).info.reason(), "CREDIT_OUT_OF_RANGE");
  EXPECT_EQ(details_of(strange.read_to_end()).info.reason(), "FRAME_RATE_OUT_OF_RANGE");
}

TEST_F(StreamTest, NoStreamGetsMoreFramesASecondThanTheServerAllows) {
  options_.max_stream_frames_per_second = 60;
  start();
  const auto session = create(bar_mesh());
  for (const auto& [asked, granted] : {std::pair(0.0, 60.0), {30.0, 30.0}, {90.0, 60.0}}) {
    v1::FrameOptions options;
    options.set_max_frames_per_second(asked);
    DeformClient client(*stub_, session, options);
    const auto opened = client.read();
    ASSERT_TRUE(opened && opened->event().has_opened());
    EXPECT_EQ(opened->event().opened().options().max_frames_per_second(), granted);
  }
}

TEST_F(StreamTest, ClosingTheInputLeavesTheFramesFlowing) {
  const auto session = create(bar_mesh());
  DeformClient client(*stub_, session);
  const auto opened = client.read();
  ASSERT_TRUE(opened && opened->event().has_opened());
  ASSERT_TRUE(client.send(ends_message(rest(), 1, 1)));
  client.close_input();
  bool is_answered = false;
  while (!is_answered) {
    const auto frame = client.next_frame(false);
    ASSERT_TRUE(frame);
    is_answered = frame->header.is_final() && frame->header.input_seq() == 1;
    v1::AckFramesRequest ack;
    ack.set_session(session.session().name());
    ack.set_stream_id(opened->event().opened().stream_id());
    ack.set_frame_seq(frame->header.frame_seq());
    v1::AckFramesResponse nothing;
    grpc::ClientContext context;
    ASSERT_TRUE(stub_->AckFrames(&context, ack, &nothing).ok());
  }
}

TEST_F(StreamTest, ATakeoverEndsTheFormerWriterAndBeginsAnEpoch) {
  const auto session = create(bar_mesh());
  DeformClient former(*stub_, session), reader(*stub_, session, with_credit(8), false);
  ASSERT_TRUE(former.send(ends_message(rest(), 4, 1)));
  ASSERT_TRUE(former.settle(4));
  ASSERT_TRUE(reader.settle(4));
  v1::AcquireWriterRequest acquire;
  acquire.set_session(session.session().name());
  v1::AcquireWriterResponse lease;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->AcquireWriter(&context, acquire, &lease).ok());
  EXPECT_EQ(lease.epoch(), 2u);
  EXPECT_EQ(lease.input_seq(), 4u);
  EXPECT_TRUE(former.read_to_end().ok());
  ASSERT_EQ(former.history.ends.size(), 1u);
  EXPECT_EQ(former.history.ends[0].reason(), v1::GO_AWAY_REASON_WRITER_REPLACED);
  EXPECT_EQ(update(session, tip_message(5, 2)).error_code(), grpc::StatusCode::PERMISSION_DENIED);
  v1::CreateSessionResponse taken = session;
  taken.set_writer_token(lease.writer_token());
  ASSERT_TRUE(update(taken, tip_message(5, 2)).ok());
  const auto frame = reader.settle(5);
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->header.epoch(), 2u);
  expect_invariants(former.history, 2);
  expect_invariants(reader.history, 8);
}

TEST_F(StreamTest, DeletionEndsStreamsWithThatReason) {
  const auto session = create(bar_mesh());
  DeformClient client(*stub_, session);
  ASSERT_TRUE(client.next_frame());
  v1::DeleteSessionRequest request;
  request.set_session(session.session().name());
  v1::DeleteSessionResponse response;
  grpc::ClientContext context;
  ASSERT_TRUE(stub_->DeleteSession(&context, request, &response).ok());
  EXPECT_TRUE(client.read_to_end().ok());
  ASSERT_EQ(client.history.ends.size(), 1u);
  EXPECT_EQ(client.history.ends[0].reason(), v1::GO_AWAY_REASON_SESSION_DELETED);
}

class ManualTimeTest : public ServiceTest {
 protected:
  void SetUp() override {
    timers_ = std::make_shared<ManualTimers>();
    start();
  }
};

TEST_F(ManualTimeTest, SilentStreamsSaySomethingNowAndThen) {
  const auto session = create(bar_mesh());
  DeformClient client(*stub_, session);
  ASSERT_TRUE(client.next_frame(false));
  // Runs what was scheduled for a moment that has just passed.
  const std::jthread clock([this](const std::stop_token& stop) {
    for (; !stop.stop_requested(); std::this_thread::sleep_for(std::chrono::milliseconds(5)))
      timers_->advance(std::chrono::seconds(0));
  });
  while (client.history.heartbeats < 3) {
    timers_->advance(std::chrono::seconds(15));
    ASSERT_TRUE(client.read());
  }
}

TEST_F(ManualTimeTest, AStreamThatNobodyOpensEnds) {
  grpc::ClientContext context;
  const auto stream = stub_->Deform(&context);
  std::atomic<bool> is_over = false;
  std::thread reading([&] {
    v1::DeformResponse response;
    EXPECT_FALSE(stream->Read(&response));
    is_over = true;
  });
  while (!is_over) {
    timers_->advance(std::chrono::seconds(20));
    std::this_thread::yield();
  }
  reading.join();
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);  // clients try again
  EXPECT_EQ(details_of(status).info.reason(), "STREAM_UNOPENED");
}

TEST_F(ManualTimeTest, AResultComesAgainWithItsCertificateWhereItWasAskedFor) {
  const auto session = create(bar_mesh());
  v1::FrameOptions options = with_credit(8);
  options.set_certify(true);
  DeformClient client(*stub_, session, options);
  DeformClient plain(*stub_, session, with_credit(8), false);
  ASSERT_TRUE(client.send(ends_message(rest(), 1, 1)));
  const auto first = client.settle(1);
  ASSERT_TRUE(first);
  EXPECT_FALSE(first->header.has_certificate());
  ASSERT_TRUE(plain.settle(1));

  timers_->advance(std::chrono::milliseconds(100));
  const auto again = client.next_frame();
  ASSERT_TRUE(again);
  ASSERT_TRUE(again->header.has_certificate());
  EXPECT_LT(again->header.certificate().relative_gap(), 1e-4);
  EXPECT_TRUE(again->header.is_final());
  EXPECT_GT(again->header.frame_seq(), first->header.frame_seq());
  EXPECT_EQ(again->header.input_seq(), 1u);
  EXPECT_EQ(again->positions, first->positions);

  ASSERT_TRUE(client.send(tip_message(2, 2)));
  const auto moved = plain.next_frame();  // nothing between
  ASSERT_TRUE(moved);
  EXPECT_EQ(moved->header.input_seq(), 2u);
  EXPECT_FALSE(moved->header.has_certificate());
  ASSERT_TRUE(client.settle(2));
  expect_invariants(client.history, 8);
}

TEST_F(ManualTimeTest, ExpiryEndsStreamsWithThatReason) {
  const auto session = create(bar_mesh());
  DeformClient client(*stub_, session);
  ASSERT_TRUE(client.next_frame(false));
  timers_->advance(std::chrono::minutes(10));
  EXPECT_TRUE(client.read_to_end().ok());
  ASSERT_EQ(client.history.ends.size(), 1u);
  EXPECT_EQ(client.history.ends[0].reason(), v1::GO_AWAY_REASON_SESSION_EXPIRED);
  EXPECT_EQ(update(session, tip_message(1, 1)).error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST_F(StreamTest, DrainingEndsStreamsAndTheServer) {
  const auto session = create(bar_mesh());
  DeformClient client(*stub_, session);
  ASSERT_TRUE(client.next_frame(false));
  server_->drain(std::chrono::seconds(60));
  EXPECT_TRUE(client.read_to_end().ok());
  ASSERT_EQ(client.history.ends.size(), 1u);
  EXPECT_EQ(client.history.ends[0].reason(), v1::GO_AWAY_REASON_DRAINING);
  EXPECT_GT(client.history.ends[0].reconnect_after_ms(), 0u);
}

}  // namespace
}  // namespace lpdeform
