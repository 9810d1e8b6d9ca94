// How a session recovers, against a server whose every message the test chooses.

#include <future>

#include "tests/client/link_fixture.h"

namespace lpdeform::client {
namespace {

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

TEST_F(LinkTest, RecreatesALostSessionFromWhatTheServerHadAccepted) {
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
  lost->end(session_unknown());
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

TEST_F(LinkTest, RecreatingASessionTwiceIsTheSameRequestToTheLastBit) {
  open(200'000);  // large enough for an upload
  rpc_->create_ends = {absl::UnavailableError("the answer was lost")};
  opened_stream()->end(session_unknown());
  const auto old = rpc_->next_stream();
  ASSERT_NE(old, nullptr);
  old->end(session_unknown());
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
  broken->end(session_unknown());

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

TEST_F(LinkTest, AStreamOfAnotherMeshEndsTheSession) {
  open();
  ASSERT_TRUE(link_->poll().ok());
  const auto stream = rpc_->next_stream();
  ASSERT_NE(stream, nullptr);
  v1::DeformResponse opened;
  opened.mutable_event()->mutable_opened()->set_vertex_count(kVertexCount + 1);
  stream->say(opened);
  const absl::Status ended = next_frame().status();
  EXPECT_TRUE(absl::IsDataLoss(ended));
  EXPECT_EQ(fault_of(ended).reason, "FRAME_VERTICES");
  EXPECT_EQ(link_->connection(), Connection::kClosed);
}

TEST_F(LinkTest, AnExceptionOnAThreadOfItsEndsTheSessionWithItsText) {
  open();
  rpc_->deform_throws = true;
  const absl::Status ended = next_frame().status();
  EXPECT_EQ(fault_of(ended).reason, "EXCEPTION");
  EXPECT_EQ(ended.message(), "no stream");
  EXPECT_EQ(link_->connection(), Connection::kClosed);
}

TEST_F(LinkTest,
       AnExceptionWhileReadingEndsTheSessionWithItsText) {  // it would happen again on the next stream
  open();
  opened_stream()->throw_once();
  const absl::Status ended = next_frame().status();
  EXPECT_EQ(fault_of(ended).reason, "EXCEPTION");
  EXPECT_EQ(ended.message(), "no message");
}

TEST_F(LinkTest, ANameThatIsNotUtf8IsRefusedAtTheCall) {
  open();
  EXPECT_EQ(fault_of(link_->update(adding("t\xc3")).status()).reason, "NAME_ENCODING");
  EXPECT_TRUE(link_->update(adding("t\xc3\xa9")).ok());
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

TEST_F(LinkTest, SaysWhatTheServerSaidAboutItselfForAsLongAsItsStreamLasts) {
  open();
  const auto stream = opened_stream();
  EXPECT_FALSE(link_->notice());
  v1::DeformResponse said;
  const auto says = [&](v1::NoticeReason reason, const char* text) {
    said.mutable_event()->mutable_notice()->set_reason(reason);
    said.mutable_event()->mutable_notice()->set_text(text);
    stream->say(said);
    static std::uint64_t frame_seq = 0;
    stream->say(frame(++frame_seq, 0));  // after which it was heard
    EXPECT_TRUE(next_frame().ok());
    return link_->notice().value_or(Notice{});
  };
  Notice notice = says(v1::NOTICE_REASON_OVERLOADED, "Too much.");
  EXPECT_EQ(notice.reason, Notice::Reason::kOverloaded);
  EXPECT_EQ(notice.text, "Too much.");
  notice = says(v1::NOTICE_REASON_RECOVERED, "No more.");
  EXPECT_EQ(notice.reason, Notice::Reason::kRecovered);
  notice = says(static_cast<v1::NoticeReason>(9), "Something new.");
  EXPECT_EQ(notice.reason, Notice::Reason::kOther);
  EXPECT_EQ(notice.text, "Something new.");
  stream->end(absl::UnavailableError("away"));
  const auto next = rpc_->next_stream();
  EXPECT_FALSE(link_->notice());
  answered(next);
}

/// A stream that has told of a better shape for update 7, of energy 3, on a server that is overloaded.
class BetterShapeTest : public LinkTest {
 protected:
  void told() {
    open();
    stream_ = opened_stream();
    v1::DeformResponse said;
    v1::Notice& notice = *said.mutable_event()->mutable_notice();
    notice.set_reason(v1::NOTICE_REASON_OVERLOADED);
    stream_->say(said);
    notice.set_reason(v1::NOTICE_REASON_BETTER_SHAPE);
    notice.set_text("Better.");
    notice.set_input_seq(7);
    notice.set_energy(3);
    notice.set_saved_share(0.25);
    stream_->say(said);
    shows(7, 4);
    ASSERT_EQ(reason(), Notice::Reason::kBetterShape);
  }
  void shows(std::uint64_t input_seq, double energy) {
    v1::DeformResponse shown = frame(++frame_seq_, input_seq);
    shown.mutable_event()->mutable_frame()->mutable_header()->set_energy(energy);
    stream_->say(shown);
    EXPECT_TRUE(next_frame().ok());
  }
  Notice::Reason reason() { return link_->notice().value_or(Notice{}).reason; }

  std::shared_ptr<Stream> stream_;
  std::uint64_t frame_seq_ = 0;
};

TEST_F(BetterShapeTest, IsAnnouncedWithItsEnergyAndWhatItSavesAndNoMoreOnceItIsTaken) {
  told();
  const Notice notice = link_->notice().value();
  EXPECT_EQ(notice.text, "Better.");
  EXPECT_EQ(notice.input_seq, 7u);
  EXPECT_EQ(notice.energy, 3);
  EXPECT_EQ(notice.saved_share, 0.25);
  rpc_->better_shape->set_input_seq(7);
  rpc_->better_shape->set_energy(3);
  const BetterShape taken = link_->take_better_shape().value();
  EXPECT_EQ(taken.input_seq, 7u);
  EXPECT_EQ(taken.energy, 3);
  ASSERT_EQ(rpc_->taken_better().size(), 1u);
  EXPECT_EQ(rpc_->taken_better()[0].session(), "sessions/1");
  EXPECT_EQ(rpc_->taken_better()[0].writer_token(), "token");
  EXPECT_EQ(reason(), Notice::Reason::kOverloaded);
}

TEST_F(BetterShapeTest, EndsWhenAFrameShowsItEvenIfAnotherWriterTookIt) {
  told();
  shows(7, 3);
  EXPECT_EQ(reason(), Notice::Reason::kOverloaded);
}

TEST_F(BetterShapeTest, EndsWhenThereIsAFrameForALaterUpdate) {
  told();
  shows(8, 9);
  EXPECT_EQ(reason(), Notice::Reason::kOverloaded);
}

TEST_F(BetterShapeTest, EndsWithASolveOfTheSameUpdateAfterWhichTheServerSearchesAgain) {
  told();
  ASSERT_TRUE(link_->solve({}).ok());
  EXPECT_EQ(reason(), Notice::Reason::kOverloaded);
}

TEST_F(BetterShapeTest, StaysWhereASolveFails) {
  told();
  rpc_->solve_ends.push_back(absl::ResourceExhaustedError("full"));
  EXPECT_FALSE(link_->solve({}).ok());
  EXPECT_EQ(reason(), Notice::Reason::kBetterShape);
}

TEST_F(BetterShapeTest, ThatIsNotThereAnyMoreIsAnErrorAndNotAnnouncedAnyMore) {
  told();
  rpc_->better_shape = make_fault({Reason::kNoBetterShape, "", ""}, "None.");
  EXPECT_EQ(fault_of(link_->take_better_shape().status()).reason, "NO_BETTER_SHAPE");
  EXPECT_EQ(reason(), Notice::Reason::kOverloaded);
}

TEST_F(BetterShapeTest, IsAskedForOnceOnly) {
  told();
  rpc_->better_shape = absl::UnavailableError("away");
  EXPECT_EQ(link_->take_better_shape().status().code(), absl::StatusCode::kUnavailable);
  EXPECT_EQ(rpc_->taken_better().size(), 1u);
  EXPECT_EQ(reason(), Notice::Reason::kBetterShape);
}

TEST_F(BetterShapeTest, IsRefusedAfterTheEnd) {
  told();
  ASSERT_TRUE(link_->close().ok());
  EXPECT_EQ(fault_of(link_->take_better_shape().status()).reason, "SESSION_CLOSED");
  EXPECT_TRUE(rpc_->taken_better().empty());
}

TEST_F(LinkTest, SaysHowFarToLookForLowerMinimaOrLeavesItToTheServer) {
  open();
  const auto stream = opened_stream();
  const auto sent = [&](const SolverSettings& solver) {
    link_->update({.settings = {.solver = solver}}).value();
    return stream->hear()->update().settings().solver();
  };
  EXPECT_FALSE(sent({}).has_search());
  const v1::MinimaSearch search =
      sent({.search = MinimaSearch{.effort = 3, .show = true, .least_share = 0.1}}).search();
  EXPECT_EQ(search.effort(), 3u);
  EXPECT_TRUE(search.show());
  EXPECT_EQ(search.least_share(), 0.1);
  EXPECT_TRUE(sent({.search = MinimaSearch{}}).has_search());
}

TEST_F(LinkTest, LeavesTheEffortOfASearchToTheServerUnlessItIsGiven) {
  open();
  const auto stream = opened_stream();
  const auto sent = [&](const MinimaSearch& search) {
    link_->update({.settings = {.solver = SolverSettings{.search = search}}}).value();
    return stream->hear()->update().settings().solver().search();
  };
  const v1::MinimaSearch shown = sent({.show = true});
  EXPECT_TRUE(shown.show());
  EXPECT_FALSE(shown.has_effort());
  const v1::MinimaSearch none = sent({.effort = 0});
  EXPECT_TRUE(none.has_effort());
  EXPECT_EQ(none.effort(), 0u);
}

TEST_F(LinkTest, AnUndoIsAskedForAgainAfterWhatAServerThatWentAwayHasLost) {
  open();
  link_->update(adding("tip")).value();
  rpc_->undos_away = 2;  // and the newest input that it then knows is 0
  const auto undone = link_->undo(false);
  ASSERT_TRUE(undone.ok()) << undone.status();
  const auto asked = rpc_->undone();
  ASSERT_EQ(asked.size(), 3u);
  for (const v1::UndoUpdateRequest& one : asked) EXPECT_EQ(one.input_seq(), *undone);
  const auto sent = rpc_->restored();  // before it, and again before each of the others
  ASSERT_EQ(sent.size(), 3u);
  for (const v1::UpdateHandlesRequest& one : sent) EXPECT_EQ(one.update().input_seq(), 1u);
}

TEST_F(LinkTest, AnUndoGoesAfterAllUpdatesAndIsPartOfWhatASessionRecreatedGets) {
  open();
  link_->update(adding("tip")).value();
  link_->update(adding("ear")).value();
  v1::HandleUpdate removal;
  removal.set_name("ear");
  removal.mutable_remove();
  rpc_->undo_changes = {removal};
  const auto undone = link_->undo(false);
  ASSERT_TRUE(undone.ok()) << undone.status();
  ASSERT_EQ(rpc_->restored().size(), 1u);  // both updates, before it
  EXPECT_EQ(rpc_->restored()[0].update().handles_size(), 2);
  ASSERT_EQ(rpc_->undone().size(), 1u);
  EXPECT_EQ(rpc_->undone()[0].input_seq(), *undone);
  EXPECT_GT(*undone, rpc_->restored()[0].update().input_seq());
  EXPECT_FALSE(rpc_->undone()[0].redo());
  const auto stream = opened_stream();
  stream->say(go_away(v1::GO_AWAY_REASON_SESSION_EXPIRED));
  stream->end(absl::OkStatus());
  const auto next = answered(rpc_->next_stream());
  const auto all = next->hear();
  ASSERT_TRUE(all && all->has_update());
  ASSERT_EQ(all->update().handles_size(), 1);
  EXPECT_EQ(all->update().handles(0).name(), "tip");
}

TEST_F(LinkTest, AnUndoInASessionRecreatedTakesBackWhatCameAfterThatAndNotAllItsHandles) {
  open();
  const auto stream = opened_stream();
  link_->update(adding("tip")).value();
  ASSERT_TRUE(stream->hear());
  stream->say(result(1));
  stream->say(go_away(v1::GO_AWAY_REASON_SESSION_EXPIRED));
  stream->end(absl::OkStatus());
  const auto next = answered(rpc_->next_stream());
  const auto all = next->hear();
  ASSERT_TRUE(all && all->has_update());
  next->say(result(all->update().input_seq()));
  rpc_->undo_steps = 1;  // all the handles at once
  const auto refused = link_->undo(false);
  EXPECT_EQ(refused.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(fault_of(refused.status()).reason, "NOTHING_TO_UNDO");
  EXPECT_TRUE(rpc_->undone().empty());
  rpc_->undo_steps = 2;
  rpc_->undos_away = 1;  // the server takes it, and the answer is lost
  const auto undone = link_->undo(false);
  ASSERT_TRUE(undone.ok()) << undone.status();
  EXPECT_EQ(rpc_->undone().size(), 2u);
  ASSERT_TRUE(link_->undo(true).ok());  // what was taken back may be done again all the same
}

}  // namespace
}  // namespace lpdeform::client
