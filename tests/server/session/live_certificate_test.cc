// Certificates of results in a live session.

#include "live_solver_fixture.h"

namespace lpdeform {
namespace {

constexpr bool kWithCertificate = true;

TEST_F(LiveSolverTest, AResultThatStandsComesAgainWithItsCertificate) {
  const auto stream = look_on(kWithCertificate);
  Update update = hold_ends(rest(), 1, 5);
  update.settings.p = Field::Constant(1, 1.5);
  ASSERT_TRUE(mailbox_.take(update).ok());
  settle();
  const auto result = publisher_->newest();
  ASSERT_TRUE(result->is_final);
  EXPECT_FALSE(result->optimality_gap.has_value());

  timers_->advance(LiveSolver::kQuiet);
  EXPECT_EQ(rings_, 1);
  settle();
  const auto certified = publisher_->newest();
  ASSERT_TRUE(certified->optimality_gap.has_value());
  EXPECT_LT(*certified->optimality_gap, 1e-4);
  EXPECT_TRUE(certified->is_final);
  EXPECT_EQ(certified->repeats, result->frame_seq);
  EXPECT_GT(certified->frame_seq, result->frame_seq);
  EXPECT_EQ(certified->input_seq, result->input_seq);
  EXPECT_EQ(certified->surface, result->surface);

  settle();
  EXPECT_EQ(publisher_->newest(), certified);
  EXPECT_EQ(rings_, 1);
}

TEST_F(LiveSolverTest, NoCertificateIsLookedForUnlessAReaderAsks) {
  const auto stream = look_on();
  ASSERT_TRUE(mailbox_.take(hold_ends(rest(), 1, 5)).ok());
  settle();
  const auto result = publisher_->newest();
  timers_->advance(LiveSolver::kQuiet);
  settle();
  EXPECT_EQ(rings_, 0);
  EXPECT_EQ(publisher_->newest(), result);

  const auto later = look_on(kWithCertificate);  // the result has stood long enough
  settle();
  EXPECT_TRUE(publisher_->newest()->optimality_gap.has_value());
}

TEST_F(LiveSolverTest, AResultWithoutHandlesHasNoCertificate) {
  const auto stream = look_on(kWithCertificate);
  ASSERT_TRUE(mailbox_.take(hold_ends(rest(), 1, 5)).ok());
  settle();
  timers_->advance(LiveSolver::kQuiet);
  settle();
  ASSERT_TRUE(publisher_->newest()->optimality_gap.has_value());
  Update update;
  update.input_seq = 2;
  update.handles.push_back({"base", Removal{}});
  update.handles.push_back({"tip", Removal{}});
  ASSERT_TRUE(mailbox_.take(update).ok());
  settle();
  timers_->advance(2 * LiveSolver::kQuiet);
  settle();
  EXPECT_EQ(publisher_->newest()->input_seq, 2u);
  EXPECT_FALSE(publisher_->newest()->optimality_gap.has_value());
}

TEST_F(LiveSolverTest, ASolveCallsCertificateIsItsFramesToo) {
  const auto stream = look_on(kWithCertificate);
  ASSERT_TRUE(mailbox_.take(hold_ends(rest(), 1, 2)).ok());
  const auto solve = job({.certify = true});
  settle(solve.get());
  ASSERT_TRUE(result_ && result_->ok());
  EXPECT_EQ((*result_)->frame->optimality_gap, (*result_)->summary.optimality_gap);
  timers_->advance(LiveSolver::kQuiet);
  settle();
  EXPECT_EQ(publisher_->newest(), (*result_)->frame);
}

/// Large enough that a certificate takes many slices.
class LargeBarTest : public LiveSolverTest {
 protected:
  LargeBarTest() : LiveSolverTest(box_surface(16, 16, 84)) {}

  /// Until a certificate is being looked for, and not found yet.
  void begin_certificate() {
    Update update = hold_ends(rest(), 1, 20);
    update.settings.p = Field::Constant(1, 1.0);
    update.settings.solver = SolveSettings{.tolerance = 1e-2};
    ASSERT_TRUE(mailbox_.take(update).ok());
    settle();
    ASSERT_TRUE(publisher_->newest()->is_final);
    timers_->advance(LiveSolver::kQuiet);
    ASSERT_TRUE(solver_.run_slice(nullptr));
    ASSERT_FALSE(publisher_->newest()->optimality_gap.has_value());
  }
};

TEST_F(LargeBarTest, ANewerInputEndsTheSearchForACertificate) {
  const auto stream = look_on(kWithCertificate);
  begin_certificate();
  ASSERT_TRUE(mailbox_.take(move_tip(2, 21)).ok());
  solver_.run_slice(nullptr);  // the next one already works for it
  EXPECT_EQ(publisher_->newest()->input_seq, 2u);
  settle();
  EXPECT_TRUE(publisher_->newest()->is_final);
  EXPECT_FALSE(publisher_->newest()->optimality_gap.has_value());
  timers_->advance(LiveSolver::kQuiet);
  settle();
  EXPECT_TRUE(publisher_->newest()->optimality_gap.has_value());
  EXPECT_EQ(publisher_->newest()->input_seq, 2u);
}

TEST_F(LargeBarTest, AMinimumIsLookedForWhenWhoWantedTheCertificateHasLeft) {
  const auto stays = look_on(), leaves = look_on(kWithCertificate);
  begin_certificate();
  timers_->advance(LiveSolver::kSearchQuiet);
  ASSERT_TRUE(solver_.run_slice(nullptr));
  ASSERT_FALSE(solver_.is_searching());
  publisher_->remove(*leaves);
  ASSERT_TRUE(solver_.run_slice(nullptr));
  EXPECT_TRUE(solver_.is_searching());
  const auto comes = look_on(kWithCertificate);
  settle();
  EXPECT_TRUE(publisher_->newest()->optimality_gap.has_value());
}

TEST_F(LargeBarTest, ASolveCallEndsTheSearchForACertificate) {
  const auto stream = look_on(kWithCertificate);
  begin_certificate();
  const auto solve = job();
  settle(solve.get());
  ASSERT_TRUE(result_ && result_->ok());
  EXPECT_FALSE((*result_)->summary.optimality_gap.has_value());

  timers_->advance(LiveSolver::kQuiet);
  ASSERT_TRUE(solver_.run_slice(nullptr));
  const auto refused = job({.initial_positions = Points::Zero(3, 3)});
  settle(refused.get());
  EXPECT_EQ(failure(), "POSITIONS_SIZE");
  settle();
  EXPECT_TRUE(publisher_->newest()->optimality_gap.has_value());
}

}  // namespace
}  // namespace lpdeform
