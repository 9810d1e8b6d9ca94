// UndoUpdate: live frames follow, and a restart keeps the steps that can be undone.

#include <gtest/gtest.h>

#include "restart_fixture.h"

namespace lpdeform {
namespace {

class UndoTest : public RestartTest {
 protected:
  grpc::Status undo(const v1::CreateSessionResponse& session, std::uint64_t input_seq, bool redo,
                    v1::UndoUpdateResponse& response) {
    v1::UndoUpdateRequest request;
    request.set_session(session.session().name());
    request.set_writer_token(session.writer_token());
    request.set_input_seq(input_seq);
    request.set_redo(redo);
    grpc::ClientContext context;
    return stub_->UndoUpdate(&context, request, &response);
  }

  void step(const v1::CreateSessionResponse& session, std::uint64_t input_seq, double x) {
    v1::Update update = tip_message(input_seq, x);
    update.set_begins_step(true);
    EXPECT_TRUE(take(session, update).kept());
  }
};

TEST_F(UndoTest, LiveFramesFollow) {
  const TriangleMesh mesh = bar_mesh();
  const auto session = create(mesh);
  DeformClient stream(*stub_, session);
  const auto tip = static_cast<std::size_t>(vertices_at(mesh.vertices, highest_z(mesh.vertices))[0]);
  ASSERT_TRUE(stream.send(ends_message(mesh.vertices, 1, 0)));
  const auto rest = stream.settle(1);
  ASSERT_TRUE(rest.has_value());
  ASSERT_TRUE(stream.send(tip_message(2, 2)));
  const auto moved = stream.settle(2);
  ASSERT_TRUE(moved.has_value());
  v1::UndoUpdateResponse undone;
  ASSERT_TRUE(undo(session, 3, false, undone).ok());
  EXPECT_TRUE(undone.result().kept());
  ASSERT_EQ(undone.changes_size(), 1);
  EXPECT_EQ(undone.changes(0).name(), "tip");
  EXPECT_TRUE(undone.changes(0).has_move());
  EXPECT_EQ(undone.undo_steps(), 1u);
  EXPECT_EQ(undone.redo_steps(), 1u);
  const auto back = stream.settle(3);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->position<float>(tip, 0), rest->position<float>(tip, 0));
  ASSERT_TRUE(undo(session, 4, true, undone).ok());
  const auto again = stream.settle(4);
  ASSERT_TRUE(again.has_value());
  EXPECT_EQ(again->position<float>(tip, 0), moved->position<float>(tip, 0));
  expect_invariants(stream.history, 2);
}

TEST_F(UndoTest, TheHistorySurvivesTheServer) {
  const auto session = create(bar_mesh());
  take(session, ends_message(bar_mesh().vertices, 1, 0));
  for (std::uint64_t k = 2; k <= 5; ++k) step(session, k, static_cast<double>(k));
  v1::UndoUpdateResponse response;
  ASSERT_TRUE(undo(session, 6, false, response).ok());
  ASSERT_TRUE(undo(session, 7, false, response).ok());
  const std::string before = seen(session);
  restart();
  EXPECT_EQ(seen(session), before);  // with the numbers of its steps
  const auto goes_to = [&](std::uint64_t input_seq, bool redo, double x) {
    ASSERT_TRUE(undo(session, input_seq, redo, response).ok());
    EXPECT_EQ(response.changes(0).move().rigid().translation().x(), x);
  };
  goes_to(8, true, 4);
  goes_to(9, true, 5);
  EXPECT_EQ(details_of(undo(session, 10, true, response)).info.reason(), "NOTHING_TO_REDO");
  restart();  // what was done after the first one, too
  goes_to(10, false, 4);
  goes_to(11, false, 3);
  step(session, 12, 9);
  restart();
  EXPECT_EQ(details_of(undo(session, 13, true, response)).info.reason(), "NOTHING_TO_REDO");
  goes_to(13, false, 3);
}

TEST_F(UndoTest, AnAnswerThatWasLostWithItsServerCanBeHadAgain) {
  const auto session = create(bar_mesh());
  take(session, ends_message(bar_mesh().vertices, 1, 0));
  step(session, 2, 2);
  v1::Update change;
  change.set_input_seq(3);
  set_handle(change, "new", vertices_at(bar_mesh().vertices, 7), 1);
  move_handle(change, "tip", 3);
  EXPECT_TRUE(take(session, change).kept());
  const auto same_again = [&](std::uint64_t input_seq, bool redo) {
    v1::UndoUpdateResponse first, again, other;
    ASSERT_TRUE(undo(session, input_seq, redo, first).ok());
    const std::string before = seen(session);
    restart();
    const grpc::Status status = undo(session, input_seq, redo, again);
    ASSERT_TRUE(status.ok()) << status.error_message();
    EXPECT_EQ(again.DebugString(), first.DebugString());
    EXPECT_EQ(seen(session), before);
    EXPECT_EQ(details_of(undo(session, input_seq, !redo, other)).info.reason(), "INPUT_SEQ_PASSED");
  };
  same_again(4, false);  // "new" goes
  same_again(5, true);   // and comes
  same_again(6, false);
  same_again(7, false);  // a motion alone
  EXPECT_TRUE(take(session, tip_message(8, 1)).kept());
  restart();
  v1::UndoUpdateResponse response;
  EXPECT_EQ(details_of(undo(session, 8, false, response)).info.reason(), "INPUT_SEQ_PASSED");
}

TEST_F(UndoTest, WhoDoesNotWriteTakesNothingBack) {
  auto session = create(bar_mesh());
  take(session, ends_message(bar_mesh().vertices, 1, 0));
  v1::UndoUpdateResponse response;
  EXPECT_EQ(details_of(undo(session, 1, false, response)).info.reason(), "INPUT_SEQ_PASSED");
  session.set_writer_token("somebody else's");
  EXPECT_EQ(details_of(undo(session, 2, false, response)).info.reason(), "NOT_THE_WRITER");
  session.clear_writer_token();
  EXPECT_EQ(details_of(undo(session, 2, false, response)).info.reason(), "WRITER_TOKEN_MISSING");
  session.mutable_session()->set_name("sessions/nonsense");
  EXPECT_EQ(details_of(undo(session, 2, false, response)).info.reason(), "SESSION_UNKNOWN");
}

}  // namespace
}  // namespace lpdeform
