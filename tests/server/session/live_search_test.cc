// The search for lower minima in a live session.

#include <algorithm>
#include <limits>
#include <numbers>
#include <vector>

#include "live_solver_fixture.h"

namespace lpdeform {
namespace {

/// A bar that is bent by 80 degrees. At p = 1.5 its first minimum is 2.8 % above the lowest one known.
class LiveSearchTest : public LiveSolverTest {
 protected:
  LiveSearchTest() : LiveSolverTest(box_surface(6, 6, 40)) {}

  Update bend(std::uint64_t input_seq, double degrees = 80) const {
    Update update;
    update.input_seq = input_seq;
    update.handles.push_back({"base", Handle{vertices_at(rest(), 0), Fixed{}}});
    const RigidMotion turn{Eigen::Vector3d::UnitX(), degrees * std::numbers::pi / 180, {3, 3, 20}, {0, 0, 0}};
    update.handles.push_back({"tip", Handle{vertices_at(rest(), 40), turn}});
    update.settings.p = Field::Constant(1, 1.5);
    return update;
  }

  /// Takes the update, and searches once its result has stood.
  std::shared_ptr<const Frame> search(const Update& update) {
    EXPECT_TRUE(mailbox_.take(update).ok());
    settle();
    auto result = publisher_->newest();
    timers_->advance(LiveSolver::kSearchQuiet);
    settle();
    return result;
  }

  /// As a writer does it. The solver has not run since.
  bool take() { return publisher_->take_better(mailbox_.newest().input_seq).has_value(); }

  /// Until the next search begins, in units of kSearchQuiet. Runs it to its end. 0 if none comes for long.
  int wait_for_search() {
    for (int waited = 1; waited <= 300; ++waited) {
      timers_->advance(LiveSolver::kSearchQuiet);
      solver_.run_slice(nullptr);
      if (!solver_.is_searching()) continue;  // none that begins ends within a slice
      settle();
      return waited;
    }
    return 0;
  }

  static std::optional<BetterNote> announced(FrameStream& stream) {
    std::optional<BetterNote> found;
    while (const auto note = stream.next()) {
      if (const auto* better = std::get_if<BetterNote>(&*note)) found = *better;
    }
    return found;
  }
};

TEST_F(LiveSearchTest, ABetterShapeIsAnnouncedOnceAndShownWhenItIsTaken) {
  const auto stream = look_on();
  const auto result = search(bend(1));
  ASSERT_TRUE(result->is_final);
  EXPECT_EQ(publisher_->newest(), result);
  const auto better = announced(*stream);
  ASSERT_TRUE(better.has_value());
  EXPECT_EQ(better->input_seq, 1u);
  EXPECT_GT(better->saved_share, 0.02);
  EXPECT_NEAR(better->energy, (1 - better->saved_share) * result->energy, 1e-9 * result->energy);
  EXPECT_FALSE(announced(*stream).has_value());

  ASSERT_TRUE(take());
  settle();
  const auto shown = publisher_->newest();
  EXPECT_GT(shown->frame_seq, result->frame_seq);
  EXPECT_EQ(shown->input_seq, 1u);
  EXPECT_TRUE(shown->is_final);
  EXPECT_EQ(shown->energy, better->energy);
  EXPECT_NE(shown->surface->positions(), result->surface->positions());
  EXPECT_FALSE(publisher_->better().has_value());
  EXPECT_FALSE(take());
}

TEST_F(LiveSearchTest, AnInputThatFollowsATakenShapeGoesOnFromIt) {
  const auto stream = look_on();
  const auto result = search(bend(1));
  const auto better = announced(*stream);
  ASSERT_TRUE(better && take());
  ASSERT_TRUE(mailbox_.take(bend(2)).ok());  // the same handles, before the solver has run
  settle();
  EXPECT_EQ(publisher_->newest()->input_seq, 2u);
  EXPECT_TRUE(publisher_->newest()->is_final);
  EXPECT_NEAR(publisher_->newest()->energy, better->energy, 1e-3 * better->energy);
  EXPECT_FALSE(publisher_->is_better_taken());
}

TEST_F(LiveSearchTest, ALateUpdateDoesNotLoseATakenShape) {
  const auto stream = look_on();
  search(bend(5));
  const auto better = announced(*stream);
  Update late;
  late.input_seq = 3;
  late.settings.length_unit = 2;
  ASSERT_TRUE(mailbox_.take(late).ok());
  ASSERT_TRUE(better && take());
  settle();
  EXPECT_NEAR(publisher_->newest()->energy, better->energy, 1e-3 * better->energy);
}

/// A later start comes to the same minimum by another way, and is lower in the last digits.
TEST_F(LiveSearchTest, TheShapeThatWasAnnouncedIsShownWhateverALaterSearchFinds) {
  const auto stream = look_on();
  (void)search(bend(1));
  const auto better = announced(*stream);
  ASSERT_TRUE(better.has_value());
  EXPECT_GT(wait_for_search(), 0);
  EXPECT_FALSE(announced(*stream).has_value());
  ASSERT_TRUE(take());
  solver_.run_slice(nullptr);
  EXPECT_EQ(publisher_->newest()->energy, better->energy);
}

TEST_F(LiveSearchTest, TheShapeThatWasAnnouncedIsShownAlsoDuringALaterSearch) {
  const auto stream = look_on();
  (void)search(bend(1));
  const auto better = announced(*stream);
  ASSERT_TRUE(better.has_value());
  for (int waited = 0; waited < 300 && !solver_.is_searching(); ++waited) {
    timers_->advance(LiveSolver::kSearchQuiet);
    solver_.run_slice(nullptr);
  }
  EXPECT_TRUE(solver_.is_searching());
  int slices = 0;
  for (; solver_.is_searching(); ++slices) solver_.run_slice(nullptr);
  for (int waited = 0; waited < 300 && !solver_.is_searching(); ++waited) {
    timers_->advance(LiveSolver::kSearchQuiet);
    solver_.run_slice(nullptr);
  }
  for (int slice = 0; slice < slices * 3 / 4; ++slice) solver_.run_slice(nullptr);  // some starts have ended
  ASSERT_TRUE(take());
  solver_.run_slice(nullptr);
  EXPECT_EQ(publisher_->newest()->energy, better->energy);
}

TEST_F(LiveSearchTest, ARefusedSolveLeavesWhatIsAnnounced) {
  const auto stream = look_on();
  search(bend(1));
  const auto better = announced(*stream);
  Points positions = rest();
  positions(7, 1) = std::numeric_limits<double>::quiet_NaN();
  const auto refused = job({.initial_positions = positions});
  settle(refused.get());
  EXPECT_EQ(failure(), "POSITIONS_NOT_FINITE");
  ASSERT_TRUE(better && take());
  settle();
  EXPECT_EQ(publisher_->newest()->energy, better->energy);
}

TEST_F(LiveSearchTest, ASolveThatFollowsATakenShapeGoesOnFromIt) {
  const auto stream = look_on();
  search(bend(1));
  const auto better = announced(*stream);
  ASSERT_TRUE(better && take());
  const auto solve = job();
  settle(solve.get());
  ASSERT_TRUE(result_ && result_->ok());
  EXPECT_LE((*result_)->summary.energy, 1.001 * better->energy);
}

TEST_F(LiveSearchTest, ALaterReaderIsToldToo) {
  const auto stream = look_on();
  search(bend(1));
  EXPECT_TRUE(announced(*look_on()).has_value());
}

TEST_F(LiveSearchTest, ASessionThatStandsGoesOnLookingEverMoreSeldomAndEnds) {
  const auto stream = look_on();
  search(bend(1));
  const int searches = LiveSolver::kMostStarts / Deformer::kStartsOfEffort;
  for (int k = 1; k < searches; ++k) EXPECT_EQ(wait_for_search(), 1 << k);
  EXPECT_EQ(wait_for_search(), 0);
}

TEST_F(LiveSearchTest, TheStartsThatTheEffortAsksForFollowOneAnotherAtOnce) {
  const auto stream = look_on();
  Update update = bend(1);
  update.settings.solver = SolveSettings{.effort = 3};
  search(update);
  EXPECT_EQ(wait_for_search(), 1 << 3);
}

TEST_F(LiveSearchTest, ALongPauseDoesNotDelayTheSearchForANewInput) {
  const auto stream = look_on();
  search(bend(1));
  for (int k = 1; k < 4; ++k) EXPECT_GT(wait_for_search(), 0);
  ASSERT_TRUE(mailbox_.take(bend(2, 60)).ok());
  settle();
  const int rings = rings_;
  timers_->advance(LiveSolver::kSearchQuiet);
  EXPECT_GT(rings_, rings);
  solver_.run_slice(nullptr);
  EXPECT_TRUE(solver_.is_searching());
}

TEST_F(LiveSearchTest, TheSearchGoesOnOnceItsShapeIsTaken) {
  const auto stream = look_on();
  search(bend(1));
  ASSERT_TRUE(take());
  settle();
  EXPECT_EQ(wait_for_search(), 2);
}

TEST_F(LiveSearchTest, TheSearchOfASolveCallIsGoneOnWith) {
  const auto stream = look_on();
  ASSERT_TRUE(mailbox_.take(bend(1)).ok());
  const auto solve = job();
  settle(solve.get());
  ASSERT_TRUE(result_ && result_->ok());
  ASSERT_EQ((*result_)->summary.further_starts, 12);
  EXPECT_EQ(wait_for_search(), 2);
}

TEST_F(LiveSearchTest, TheSearchOfASolveCallSendsNoFrames) {
  const auto stream = look_on();
  ASSERT_TRUE(mailbox_.take(bend(1)).ok());
  const auto solve = job();
  std::vector<double> energies;  // of each frame
  auto shown = publisher_->newest();
  while (solver_.run_slice(solve.get())) {
    if (publisher_->newest() != shown) energies.push_back(publisher_->newest()->energy);
    shown = publisher_->newest();
    while (stream->next()) {
    }
    ASSERT_TRUE(stream->acknowledge(stream->last_frame_seq()).ok());
  }
  ASSERT_TRUE(result_ && result_->ok());
  EXPECT_EQ((*result_)->summary.further_starts, 12);
  // While it searches, the state is the first minimum. It is shown once, or a second time if the last iterations did not lower it.
  EXPECT_LE(std::ranges::count(energies, (*result_)->summary.minima.front()), 2);
}

TEST_F(LiveSearchTest, NothingIsSearchedBeforeTheResultHasStood) {
  const auto stream = look_on();
  ASSERT_TRUE(mailbox_.take(bend(1)).ok());
  settle();
  timers_->advance(LiveSolver::kSearchQuiet / 2);
  settle();
  EXPECT_FALSE(announced(*stream).has_value());
  timers_->advance(LiveSolver::kSearchQuiet);
  EXPECT_GE(rings_, 1);
}

TEST_F(LiveSearchTest, ANewInputEndsTheSearchAndVoidsWhatItFound) {
  const auto stream = look_on();
  search(bend(1));
  ASSERT_TRUE(announced(*stream).has_value());
  ASSERT_TRUE(mailbox_.take(bend(2, 10)).ok());
  EXPECT_FALSE(take());  // too late
  settle();
  EXPECT_EQ(publisher_->newest()->input_seq, 2u);
  EXPECT_FALSE(publisher_->better().has_value());
}

TEST_F(LiveSearchTest, WhereItIsWantedABetterShapeIsShownAtOnce) {
  const auto stream = look_on();
  Update update = bend(1);
  update.settings.solver = SolveSettings{.effort = 1, .standing = {.shows = true}};
  const auto result = search(update);
  EXPECT_LT(publisher_->newest()->energy, 0.98 * result->energy);
  EXPECT_TRUE(publisher_->newest()->is_final);
  EXPECT_FALSE(publisher_->better().has_value());
}

TEST_F(LiveSearchTest, WhatSavesLessThanTheLeastShareIsNotAnnounced) {
  const auto stream = look_on();
  Update update = bend(1);
  update.settings.solver = SolveSettings{.effort = 1, .standing = {.least_share = 0.5}};
  search(update);
  EXPECT_FALSE(announced(*stream).has_value());
}

TEST_F(LiveSearchTest, NothingIsSearchedWithoutEffortOrAtPOfTwo) {
  const auto stream = look_on();
  Update update = bend(1);
  update.settings.solver = SolveSettings{.effort = 0};
  search(update);
  EXPECT_FALSE(announced(*stream).has_value());
  EXPECT_EQ(rings_, 0);
  update = bend(2);
  update.settings.p = Field::Constant(1, 2.0);
  update.settings.solver = SolveSettings{};
  search(update);
  EXPECT_EQ(rings_, 0);
}

TEST_F(LiveSearchTest, TheSearchRestsWhileOthersWaitForAnswers) {
  const auto stream = look_on();
  ASSERT_TRUE(mailbox_.take(bend(1)).ok());
  settle();
  timers_->advance(LiveSolver::kSearchQuiet);
  EXPECT_FALSE(solver_.run_slice(nullptr, {.slice = LiveSolver::kShortSlice}));
  EXPECT_FALSE(announced(*stream).has_value());
  const int rings = rings_;
  timers_->advance(LiveSolver::kQuiet);
  EXPECT_GT(rings_, rings);
  settle();
  EXPECT_TRUE(announced(*stream).has_value());
}

TEST_F(LiveSearchTest, ACertificateComesFirstAndAgainForTheBetterShape) {
  const auto stream = look_on(true);
  search(bend(1));
  EXPECT_TRUE(publisher_->newest()->optimality_gap.has_value());
  ASSERT_TRUE(announced(*stream).has_value());
  ASSERT_TRUE(take());
  settle();
  EXPECT_FALSE(publisher_->newest()->optimality_gap.has_value());
  timers_->advance(LiveSolver::kQuiet);
  settle();
  EXPECT_TRUE(publisher_->newest()->optimality_gap.has_value());
}

}  // namespace
}  // namespace lpdeform
