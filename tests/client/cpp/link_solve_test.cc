// Session::solve against a server whose every message the test chooses.

#include <cmath>
#include <future>

#include "tests/client/link_fixture.h"

namespace lpdeform::client {
namespace {

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

TEST_F(LinkTest, SolveMakesALostSessionAgain) {
  open();
  link_->update(adding("tip")).value();
  ASSERT_TRUE(link_->solve({}).ok());
  rpc_->solve_ends.push_back(
      carry_fault(absl::StatusCode::kNotFound, {"SESSION_UNKNOWN", "", ""}, "no such session"));
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

TEST_F(LinkTest, SolveTriesAgainToRecreateALostSession) {
  open();
  rpc_->solve_ends.push_back(
      carry_fault(absl::StatusCode::kNotFound, {"SESSION_UNKNOWN", "session", ""}, "lost"));
  rpc_->create_ends.push_back(absl::UnavailableError("refused"));
  rpc_->solve_ends.push_back(
      carry_fault(absl::StatusCode::kNotFound, {"SESSION_UNKNOWN", "session", ""}, "lost"));
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

TEST_F(LinkTest, TheDeadlineOfASolveCountsWhileAnUpdateIsUnderWay) {
  open();
  const auto stream = opened_stream();
  const std::uint64_t seq = link_->update(adding("tip")).value();
  ASSERT_TRUE(stream->hear());
  const auto begin = std::chrono::steady_clock::now();
  const absl::Status late = link_->solve({.deadline_seconds = 0.05}).status();
  EXPECT_TRUE(absl::IsDeadlineExceeded(late));
  EXPECT_EQ(fault_of(late).reason, "SOLVE_UNDER_WAY");
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kPatience);
  stream->say(result(seq));
  ASSERT_TRUE(link_->solve({.deadline_seconds = 20}).ok());
  ASSERT_TRUE(link_->solve({}).ok());
  EXPECT_LT(rpc_->solve_deadlines()[0], 20);  // less what it waited
  EXPECT_GT(rpc_->solve_deadlines()[0], 0);
  EXPECT_EQ(rpc_->solve_deadlines()[1], 0);
}

/// The update was taken on the stream and not kept; the server that solves has not heard of it.
TEST_F(LinkTest, SolveBeginsAgainWithWhatTheServerLostWhereItWentBack) {
  open();
  const auto stream = opened_stream();
  link_->update(adding("base")).value();
  stream->hear();
  stream->say(result(1));
  rpc_->solve_inputs = {0, 1};
  ASSERT_TRUE(link_->solve({}).ok());
  EXPECT_EQ(rpc_->solved().size(), 2u);
  ASSERT_EQ(rpc_->restored().size(), 1u);
  EXPECT_EQ(rpc_->restored()[0].update().input_seq(), 1u);
}

/// A call may reach another server, which has only that update of all that were not kept.
TEST_F(LinkTest, SolveSendsWhatWasNotKeptWhereTheServerWentAwayMeanwhile) {
  open();
  const auto stream = opened_stream();
  link_->update(adding("base")).value();
  stream->hear();
  stream->say(result(1));
  rpc_->solve_ends = {absl::UnavailableError("killed")};
  ASSERT_TRUE(link_->solve({}).ok());
  ASSERT_EQ(rpc_->restored().size(), 1u);
  EXPECT_TRUE(rpc_->restored()[0].update().handles(0).has_set());
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
      carry_fault(absl::StatusCode::kNotFound, {"SESSION_UNKNOWN", "", ""}, "no such session"));
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
