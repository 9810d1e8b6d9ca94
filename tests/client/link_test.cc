// How a session keeps itself alive, against a server whose every word the test chooses.

#include "client/cpp/link.h"

#include <gtest/gtest.h>

#include <cmath>
#include <future>

#include "core/base/fault.h"
#include "tests/client/fake_rpc.h"

namespace lpdeform::client {
namespace {

constexpr std::uint32_t kVertexCount = 2;

class LinkTest : public testing::Test {
 protected:
  void open(std::size_t face_count = 1) {
    Mesh mesh{std::vector<double>(3 * kVertexCount), std::vector<std::uint32_t>(3 * face_count)};
    auto lease = create_session(*rpc_, mesh, {}, "id-of-the-first", {});
    ASSERT_TRUE(lease.ok());
    link_ = std::make_unique<Link>(rpc_, ClientOptions(), OpenOptions(),
                                   std::make_shared<const Mesh>(std::move(mesh)), *std::move(lease));
  }

  /// The stream that the client opens next, answered with StreamOpened.
  std::shared_ptr<Stream> opened_stream(std::uint64_t epoch = 1) {
    EXPECT_TRUE(link_->poll().ok());
    return answered(rpc_->next_stream(), epoch);
  }

  std::shared_ptr<Stream> answered(std::shared_ptr<Stream> stream, std::uint64_t epoch = 1) {
    if (stream == nullptr) return nullptr;
    const auto open = stream->hear();
    EXPECT_TRUE(open && open->has_open());
    if (open) open_ = open->open();
    v1::DeformResponse response;
    response.mutable_event()->mutable_opened()->set_epoch(epoch);
    response.mutable_event()->mutable_opened()->set_vertex_count(kVertexCount);
    stream->say(response);
    return stream;
  }

  absl::StatusOr<Frame> next_frame() { return link_->next_frame(FrameBox::Clock::now() + kPatience); }

  static Update adding(const std::string& name) {
    Update update;
    update.handles.emplace(name, Handle{{0}, Fixed{}});
    return update;
  }

  const std::shared_ptr<FakeRpc> rpc_ = std::make_shared<FakeRpc>(kVertexCount);
  v1::DeformOpen open_;
  std::unique_ptr<Link> link_;
};

v1::DeformResponse frame(std::uint64_t frame_seq, std::uint64_t input_seq, std::uint64_t epoch = 1) {
  v1::DeformResponse response;
  v1::FramePart& part = *response.mutable_event()->mutable_frame();
  part.set_frame_seq(frame_seq);
  part.set_vertex_count(kVertexCount);
  part.set_positions(std::string(kVertexCount * 12, '\0'));
  part.set_last(true);
  v1::FrameHeader& header = *part.mutable_header();
  header.set_frame_seq(frame_seq);
  header.set_input_seq(input_seq);
  header.set_epoch(epoch);
  header.set_vertex_count(kVertexCount);
  header.set_converged(true);
  return response;
}

v1::DeformResponse result(std::uint64_t input_seq) {
  v1::DeformResponse response;
  response.mutable_result()->set_input_seq(input_seq);
  return response;
}

v1::DeformResponse refusal(std::uint64_t input_seq) {
  v1::DeformResponse response;
  v1::Fault& fault = *response.mutable_event()->mutable_fault();
  fault.set_code(3);
  fault.set_reason("HANDLE_VERTEX_OUT_OF_RANGE");
  fault.set_element("vertex 9");
  fault.set_input_seq(input_seq);
  return response;
}

v1::DeformResponse go_away(v1::GoAwayReason reason) {
  v1::DeformResponse response;
  response.mutable_event()->mutable_go_away()->set_reason(reason);
  return response;
}

TEST_F(LinkTest, AcknowledgesAFrameWhenItIsTakenAndNotBefore) {
  open();
  const auto stream = opened_stream();
  stream->say(frame(1, 0));
  stream->say(frame(2, 0));
  link_->update(adding("tip")).value();
  const auto update = stream->hear();
  ASSERT_TRUE(update && update->has_update());
  stream->say(result(1));
  stream->say(frame(3, 1));
  ASSERT_EQ(link_->settle(FrameBox::Clock::now() + kPatience)->input_seq, 1u);
  std::uint64_t acknowledged = 0;
  while (acknowledged < 3) {
    const auto ack = stream->hear();
    ASSERT_TRUE(ack && ack->has_ack());
    EXPECT_GT(ack->ack().frame_seq(), acknowledged);
    acknowledged = ack->ack().frame_seq();
  }
}

TEST_F(LinkTest, SendsNothingBeforeTheStreamIsOpen) {
  open();
  link_->update(adding("tip")).value();
  ASSERT_TRUE(link_->poll().ok());
  const auto stream = rpc_->next_stream();
  ASSERT_NE(stream, nullptr);
  const auto open = stream->hear();
  ASSERT_TRUE(open && open->has_open());
  EXPECT_EQ(open->open().writer_token(), "token");
  EXPECT_EQ(stream->unheard(), 0u);
}

TEST_F(LinkTest, HandsOutARefusalOnceAndGoesOn) {
  open();
  const auto stream = opened_stream();
  link_->update(adding("tip")).value();
  stream->hear();
  stream->say(refusal(1));
  const absl::Status refused = next_frame().status();
  EXPECT_EQ(fault_of(refused).element, "vertex 9");
  stream->say(frame(1, 0));
  EXPECT_TRUE(next_frame().ok());
}

TEST_F(LinkTest, ResumesTheSameSessionAndSendsAgainWhatWasNotAnswered) {
  open();
  const auto broken = opened_stream();
  link_->update(adding("tip")).value();
  ASSERT_TRUE(broken->hear()->has_update());
  broken->end(absl::UnavailableError("connection reset"));

  const auto stream = answered(rpc_->next_stream());
  ASSERT_NE(stream, nullptr);
  EXPECT_EQ(open_.session(), "sessions/1");
  const auto again = stream->hear();
  ASSERT_TRUE(again && again->has_update());
  EXPECT_EQ(again->update().input_seq(), 1u);
  EXPECT_EQ(rpc_->created().size(), 1u);
}

TEST_F(LinkTest, ResumesWhenTheServerDrains) {
  open();
  const auto draining = opened_stream();
  draining->say(go_away(v1::GO_AWAY_REASON_DRAINING));
  draining->end(absl::OkStatus());
  const auto stream = answered(rpc_->next_stream());
  ASSERT_NE(stream, nullptr);
  stream->say(frame(1, 0));
  EXPECT_TRUE(next_frame().ok());
}

TEST_F(LinkTest, MakesALostSessionAnewFromWhatTheServerHadAccepted) {
  open();
  const auto broken = opened_stream();
  link_->update(adding("tip")).value();
  ASSERT_TRUE(broken->hear()->has_update());
  broken->say(result(1));
  broken->say(frame(8, 1));
  ASSERT_EQ(next_frame()->input_seq, 1u);
  broken->end(absl::UnavailableError("killed"));

  const auto lost = rpc_->next_stream();
  ASSERT_NE(lost, nullptr);
  lost->end(absl::NotFoundError("no such session"));
  const auto stream = answered(rpc_->next_stream());
  ASSERT_NE(stream, nullptr);
  EXPECT_EQ(open_.session(), "sessions/2");
  ASSERT_EQ(rpc_->created().size(), 2u);
  EXPECT_NE(rpc_->created()[0].request_id(), rpc_->created()[1].request_id());

  const auto restore = stream->hear();
  ASSERT_TRUE(restore && restore->has_update());
  EXPECT_EQ(restore->update().input_seq(), 1u);
  ASSERT_EQ(restore->update().handles_size(), 1);
  EXPECT_EQ(restore->update().handles(0).name(), "tip");
  stream->say(result(1));
}

TEST_F(LinkTest, MakingASessionAnewAgainIsTheSameRequestToTheLastBit) {
  open(200'000);  // large enough for an upload
  rpc_->create_ends = {absl::UnavailableError("the answer was lost")};
  opened_stream()->end(absl::NotFoundError("no such session"));
  const auto old = rpc_->next_stream();
  ASSERT_NE(old, nullptr);
  old->end(absl::NotFoundError("no such session"));
  ASSERT_NE(answered(rpc_->next_stream()), nullptr);
  EXPECT_EQ(open_.session(), "sessions/3");
  ASSERT_EQ(rpc_->created().size(), 3u);
  EXPECT_EQ(rpc_->created()[1].SerializeAsString(), rpc_->created()[2].SerializeAsString());
}

TEST_F(LinkTest, NeverShowsAFrameOfAnOlderInputAndGivesItsCreditBack) {
  open();
  const auto broken = opened_stream();
  broken->say(frame(8, 5));
  ASSERT_EQ(next_frame()->input_seq, 5u);
  broken->end(absl::NotFoundError("no such session"));

  const auto stream = answered(rpc_->next_stream());
  ASSERT_NE(stream, nullptr);
  stream->say(frame(1, 0));
  const auto ack = stream->hear();
  ASSERT_TRUE(ack && ack->has_ack());
  EXPECT_EQ(ack->ack().frame_seq(), 1u);
  stream->say(frame(2, 5));
  EXPECT_EQ(next_frame()->frame_seq, 2u);
}

TEST_F(LinkTest, NeverShowsAFrameOfAnOldEpoch) {
  open();
  const auto broken = opened_stream(3);
  broken->say(frame(1, 1, 3));
  ASSERT_TRUE(next_frame().ok());
  broken->end(absl::UnavailableError("reset"));
  const auto stream = answered(rpc_->next_stream(), 4);
  ASSERT_NE(stream, nullptr);
  stream->say(frame(9, 1, 3));
  stream->say(frame(1, 1, 4));
  EXPECT_EQ(next_frame()->epoch, 4u);
}

TEST_F(LinkTest, SaysThatAnotherWriterTookOverUntilItTakesOverItself) {
  open();
  const auto stream = opened_stream();
  stream->say(go_away(v1::GO_AWAY_REASON_WRITER_REPLACED));
  stream->end(absl::OkStatus());
  for (int k = 0; k < 2; ++k) EXPECT_EQ(fault_of(next_frame().status()).reason, "WRITER_REPLACED");

  ASSERT_TRUE(link_->take_over().ok());
  EXPECT_EQ(*link_->update(adding("tip")), 101u);
  const auto ours = opened_stream(2);
  ASSERT_NE(ours, nullptr);
  EXPECT_EQ(open_.writer_token(), "another token");
  EXPECT_EQ(ours->hear()->update().input_seq(), 101u);
}

TEST_F(LinkTest, EndsForGoodWhereTheSessionWasDeleted) {
  open();
  const auto stream = opened_stream();
  stream->say(go_away(v1::GO_AWAY_REASON_SESSION_DELETED));
  stream->end(absl::OkStatus());
  const absl::Status ended = next_frame().status();
  EXPECT_TRUE(absl::IsNotFound(ended));
  EXPECT_EQ(fault_of(ended).reason, "SESSION_DELETED");
  EXPECT_EQ(link_->connection(), Connection::kClosed);
}

TEST_F(LinkTest, AMisfittingFrameBreaksTheStreamAndNotTheSession) {
  open();
  const auto stream = opened_stream();
  v1::DeformResponse broken = frame(1, 0);
  broken.mutable_event()->mutable_frame()->set_positions("abc");
  stream->say(broken);
  const auto next = answered(rpc_->next_stream());
  ASSERT_NE(next, nullptr);
  next->say(frame(1, 0));
  EXPECT_TRUE(next_frame().ok());
}

TEST_F(LinkTest, CloseEndsAWaitingCallAndDeletesTheSession) {
  open();
  opened_stream();
  auto waiting = std::async(std::launch::async, [this] { return next_frame().status(); });
  EXPECT_TRUE(link_->close().ok());
  EXPECT_EQ(fault_of(waiting.get()).reason, "SESSION_CLOSED");
  EXPECT_EQ(rpc_->deleted(), std::vector<std::string>{"sessions/1"});
  EXPECT_EQ(fault_of(link_->update(adding("tip")).status()).reason, "SESSION_CLOSED");
  EXPECT_TRUE(link_->close().ok());
}

TEST_F(LinkTest, ALargeMeshIsUploadedAndASmallOneIsNot) {
  open();
  EXPECT_EQ(rpc_->created()[0].mesh().data().source_case(), v1::Buffer::kInline);
  open(200'000);  // 2.4 MB of indices
  EXPECT_EQ(rpc_->created()[1].mesh().data().source_case(), v1::Buffer::kUpload);
}

TEST_F(LinkTest, DeletesItsUploadsOnceTheyHaveServed) {
  open(100000);
  ASSERT_EQ(rpc_->uploads_deleted(1).size(), 1u);
  const auto stream = opened_stream();
  Update update;
  update.settings.p = std::vector<double>(200000, 1.5);
  ASSERT_TRUE(link_->update(update).ok());
  const auto sent = stream->hear();
  ASSERT_TRUE(sent && sent->has_update());
  EXPECT_EQ(rpc_->uploads_deleted(0).size(), 1u);
  stream->say(result(1));
  const auto deleted = rpc_->uploads_deleted(2);
  ASSERT_EQ(deleted.size(), 2u);
  EXPECT_EQ(deleted[1], sent->update().settings().p().per_vertex().values().upload());
}

TEST_F(LinkTest, SolveSendsWhatWaitsAndWorksWithoutAStream) {
  open();
  link_->update(adding("tip")).value();
  const auto solved = link_->solve({});
  ASSERT_TRUE(solved.ok()) << solved.status();
  EXPECT_EQ(solved->positions.size(), 3 * kVertexCount);
  ASSERT_EQ(rpc_->solved().size(), 1u);
  EXPECT_EQ(rpc_->solved()[0].update().handles(0).name(), "tip");
  ASSERT_TRUE(link_->solve({}).ok());
  EXPECT_FALSE(rpc_->solved()[1].has_update());
}

TEST_F(LinkTest, SolveMakesALostSessionAnew) {
  open();
  link_->update(adding("tip")).value();
  ASSERT_TRUE(link_->solve({}).ok());
  rpc_->solve_ends.push_back(
      make_fault(absl::StatusCode::kNotFound, {"SESSION_UNKNOWN", "", ""}, "no such session"));
  ASSERT_TRUE(link_->solve({}).ok());
  EXPECT_EQ(link_->name(), "sessions/2");
  ASSERT_EQ(rpc_->restored().size(), 1u);
  EXPECT_EQ(rpc_->restored()[0].update().handles(0).name(), "tip");
}

TEST_F(LinkTest, SolveTriesAgainWhileTheServerIsAway) {
  open();
  ASSERT_TRUE(link_->update(adding("tip")).ok());
  rpc_->solve_ends = {absl::UnavailableError("connection reset"), absl::UnavailableError("refused")};
  const auto solved = link_->solve({});
  ASSERT_TRUE(solved.ok()) << solved.status();
  ASSERT_EQ(rpc_->solved().size(), 3u);
  EXPECT_EQ(rpc_->solved()[2].update().handles(0).name(), "tip");
  EXPECT_EQ(rpc_->solved()[2].update().input_seq(), rpc_->solved()[0].update().input_seq());
}

TEST_F(LinkTest, SolveTriesAgainToMakeALostSessionAnew) {
  open();
  rpc_->solve_ends.push_back(
      make_fault(absl::StatusCode::kNotFound, {"SESSION_UNKNOWN", "session", ""}, "lost"));
  rpc_->create_ends.push_back(absl::UnavailableError("refused"));
  rpc_->solve_ends.push_back(
      make_fault(absl::StatusCode::kNotFound, {"SESSION_UNKNOWN", "session", ""}, "lost"));
  ASSERT_TRUE(link_->solve({}).ok());
  EXPECT_NE(rpc_->solved().back().session(), rpc_->solved().front().session());
}

TEST_F(LinkTest, SolveGivesUpAtItsDeadlineWhileTheServerIsAway) {
  open();
  rpc_->solve_ends.assign(1000, absl::UnavailableError("refused"));
  EXPECT_TRUE(absl::IsUnavailable(link_->solve({.deadline_seconds = 0.2}).status()));
  EXPECT_GE(rpc_->solved().size(), 2u);
  EXPECT_LT(rpc_->solved().size(), 12u);  // pauses of at least 25 ms
}

TEST_F(LinkTest, CloseEndsASolveThatWaitsForTheServer) {
  open();
  rpc_->solve_ends.assign(1000, absl::UnavailableError("refused"));
  auto solved = std::async(std::launch::async, [this] { return link_->solve({}).status(); });
  while (rpc_->solved().size() < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(link_->close().ok());
  EXPECT_TRUE(absl::IsCancelled(solved.get()));
}

TEST_F(LinkTest, SolveKeepsAnUpdateThatWasTakenThoughItCouldNotBeSolvedFor) {
  open();
  link_->update(adding("tip")).value();
  rpc_->solve_ends.push_back(absl::FailedPreconditionError("component 1 has no handle"));
  EXPECT_TRUE(absl::IsFailedPrecondition(link_->solve({}).status()));
  rpc_->solve_ends.push_back(
      make_fault(absl::StatusCode::kNotFound, {"SESSION_UNKNOWN", "", ""}, "no such session"));
  ASSERT_TRUE(link_->solve({}).ok());
  ASSERT_EQ(rpc_->restored().size(), 1u);
}

TEST_F(LinkTest, SolveRefusesInitialPositionsThatDoNotFit) {
  open();
  EXPECT_EQ(fault_of(link_->solve({.initial_positions = {{1, 2}}}).status()).reason, "POSITIONS_SIZE");
  const absl::Status status = link_->solve({.initial_positions = {{0, 0, 0, 0, NAN, 0}}}).status();
  EXPECT_EQ(fault_of(status).element, "vertex 1");
  EXPECT_TRUE(rpc_->solved().empty());
}

TEST_F(LinkTest, SolveForgetsAnUpdateThatIsRefused) {
  open();
  link_->update(adding("tip")).value();
  rpc_->solve_ends.push_back(absl::InvalidArgumentError("vertex 9"));
  EXPECT_TRUE(absl::IsInvalidArgument(link_->solve({}).status()));
  ASSERT_TRUE(link_->solve({}).ok());
  EXPECT_FALSE(rpc_->solved()[1].has_update());
}

}  // namespace
}  // namespace lpdeform::client
