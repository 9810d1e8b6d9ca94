#include "server/session/live_solver.h"

#include <algorithm>
#include <atomic>
#include <limits>
#include <numbers>
#include <thread>
#include <utility>
#include <vector>

#include "core/shapes/shapes.h"
#include "live_solver_fixture.h"

namespace lpdeform {
namespace {

TEST_F(LiveSolverTest, BeginsWithTheRestMeshAsItsResult) {
  const auto frame = publisher_->newest();
  EXPECT_TRUE(frame->is_final);
  EXPECT_EQ(frame->input_seq, 0u);
  EXPECT_EQ(frame->surface->positions(), rest());
}

TEST_F(LiveSolverTest, AnswersTheNewestInputWithAConvergedFrame) {
  const auto stream = look_on();
  ASSERT_TRUE(mailbox_.take(hold_ends(rest(), 1, 1)).ok());
  settle();
  ASSERT_TRUE(mailbox_.take(move_tip(2, 3)).ok());
  ASSERT_TRUE(mailbox_.take(move_tip(3, 5)).ok());
  settle();
  const auto frame = publisher_->newest();
  EXPECT_TRUE(frame->is_final);
  EXPECT_EQ(frame->input_seq, 3u);
  EXPECT_EQ(frame->taken, 3u);
  EXPECT_EQ(frame->stop_reason, StopReason::kConverged);
  const auto tip = vertices_at(rest(), highest_z(rest()));
  EXPECT_NEAR(frame->surface->positions()(tip[0], 0), rest()(tip[0], 0) + 5, 1e-9);
  EXPECT_FALSE(solver_.run_slice(nullptr));
  EXPECT_EQ(publisher_->newest(), frame);
}

TEST_F(LiveSolverTest, RestsWhileNobodyLooksOn) {
  ASSERT_TRUE(mailbox_.take(hold_ends(rest(), 1, 1)).ok());
  const auto before = publisher_->newest();
  EXPECT_FALSE(solver_.run_slice(nullptr));
  EXPECT_EQ(publisher_->newest(), before);
  const auto stream = look_on();
  settle();
  EXPECT_EQ(publisher_->newest()->input_seq, 1u);
  EXPECT_TRUE(publisher_->newest()->is_final);
}

TEST_F(LiveSolverTest, WhatWaitsForAReaderWithoutCreditIsRenewed) {
  auto stream = std::make_shared<FrameStream>(StreamOptions{.credit = 1}, publisher_, timers_,
                                              std::chrono::seconds(15), OpenedNote{});
  ASSERT_TRUE(publisher_->add(stream));
  while (stream->next()) {
  }
  ASSERT_FALSE(stream->wants_frame(0));
  Update update = hold_ends(rest(), 1, 8);
  update.settings.p = Field::Constant(1, 1.0);
  update.settings.solver =
      SolveSettings{.method = Method::kLineSearch, .tolerance = 1e-14, .max_iterations = 1 << 30};
  ASSERT_TRUE(mailbox_.take(update).ok());
  for (int renewed = 0; renewed < 2; ++renewed) {
    const std::uint64_t before = publisher_->newest()->frame_seq;
    int slices = 0;
    while (publisher_->newest()->frame_seq == before) {
      ASSERT_TRUE(solver_.run_slice(nullptr));
      ASSERT_LT(++slices, kMostSlices);
    }
    EXPECT_EQ(publisher_->newest()->input_seq, 1u);
    EXPECT_FALSE(publisher_->newest()->is_final);
  }
}

TEST_F(LiveSolverTest, FramesKeepComingWhileItRefines) {
  const auto stream = look_on();
  Update update = hold_ends(rest(), 1, 8);
  update.settings.solver = SolveSettings{.method = Method::kLineSearch, .tolerance = 1e-9};
  ASSERT_TRUE(mailbox_.take(update).ok());
  std::uint64_t seen = 0, refining = 0, last_seq = 0;
  double energy = std::numeric_limits<double>::infinity();
  for (int slice = 0; slice < 30 && solver_.run_slice(nullptr); ++slice) {
    while (const auto note = stream->next()) {
      const auto* const piece = std::get_if<FramePiece>(&*note);
      if (piece == nullptr) continue;
      ++seen;
      EXPECT_GT(piece->frame->frame_seq, last_seq);
      last_seq = piece->frame->frame_seq;
      if (piece->frame->input_seq == 1 && !piece->frame->is_final) {
        ++refining;
        EXPECT_LE(piece->frame->energy, energy);
        energy = piece->frame->energy;
      }
      ASSERT_TRUE(stream->acknowledge(last_seq).ok());
    }
  }
  EXPECT_GE(refining, 3u);
}

TEST_F(LiveSolverTest, UnderOverloadAnswersComeAtOnceAndRefinementsSeldom) {
  const auto stream = look_on();
  const LiveSolver::Pace pace{.slice = LiveSolver::kShortSlice, .is_sparing = true};
  for (std::uint64_t input = 1; input <= 3; ++input) {
    Update update = hold_ends(rest(), input, 8 + static_cast<double>(input));
    update.settings.p = Field::Constant(1, 1.0);
    update.settings.solver =
        SolveSettings{.method = Method::kLineSearch, .tolerance = 1e-14, .max_iterations = 1 << 30};
    ASSERT_TRUE(mailbox_.take(update).ok());
    const auto begin = std::chrono::steady_clock::now();
    ASSERT_TRUE(solver_.run_slice(nullptr, pace));
    const auto answer = publisher_->newest();
    EXPECT_EQ(answer->input_seq, input);  // in the first slice
    while (publisher_->newest() == answer) ASSERT_TRUE(solver_.run_slice(nullptr, pace));
    EXPECT_GE(std::chrono::steady_clock::now() - begin, LiveSolver::kBetweenRefinements);
    while (stream->next()) {
    }
    ASSERT_TRUE(stream->acknowledge(publisher_->newest()->frame_seq).ok());
  }
}

TEST_F(LiveSolverTest, ASliceOfNoTimeMakesAStep) {
  const auto stream = look_on();
  ASSERT_TRUE(mailbox_.take(hold_ends(rest(), 1, 8)).ok());
  ASSERT_TRUE(solver_.run_slice(nullptr, {.slice = LiveSolver::kOneStep, .is_sparing = true}));
  EXPECT_EQ(publisher_->newest()->input_seq, 1u);
  EXPECT_EQ(publisher_->newest()->iteration, 1u);
}

TEST_F(LiveSolverTest, ASliceEndsWhenNewerInputsCome) {
  const auto stream = look_on();
  Update update = hold_ends(rest(), 1, 8);
  update.settings.solver =
      SolveSettings{.method = Method::kLineSearch, .tolerance = 1e-14, .max_iterations = 1 << 30};
  ASSERT_TRUE(mailbox_.take(update).ok());
  for (std::uint64_t input = 2; input <= 6; ++input) {
    ASSERT_TRUE(solver_.run_slice(nullptr));  // the first one for its inputs; the next one only refines
    std::atomic<bool> is_running = false;
    std::jthread updating([&] {
      is_running.wait(false);
      EXPECT_TRUE(mailbox_.take(hold_ends(rest(), input, 8 + 0.1 * static_cast<double>(input))).ok());
    });
    is_running = true;
    is_running.notify_one();
    ASSERT_TRUE(solver_.run_slice(nullptr, {.slice = std::chrono::hours(1)}));
    EXPECT_FALSE(publisher_->newest()->is_final);
  }
}

TEST_F(LiveSolverTest, ASolveCallRunsWithoutReadersAndReports) {
  ASSERT_TRUE(mailbox_.take(hold_ends(rest(), 4, 2)).ok());
  const auto solve = job({.certify = true, .keep_trace = true});
  settle(solve.get());
  ASSERT_TRUE(result_ && result_->ok());
  const SolveResult& result = **result_;
  EXPECT_EQ(result.summary.stop_reason, StopReason::kConverged);
  EXPECT_TRUE(result.summary.optimality_gap.has_value());
  EXPECT_EQ(result.summary.trace.size(), static_cast<std::size_t>(result.summary.iterations) + 1);
  EXPECT_EQ(result.frame->input_seq, 4u);
  EXPECT_TRUE(result.frame->is_final);
  EXPECT_GE(reports_, 0);
}

TEST_F(LiveSolverTest, ANewerUpdateSupersedesASolveCall) {
  ASSERT_TRUE(mailbox_.take(hold_ends(rest(), 1, 2)).ok());
  const auto solve = job();
  ASSERT_TRUE(mailbox_.take(move_tip(2, 3)).ok());
  solver_.run_slice(solve.get());
  EXPECT_EQ(failure(), "SUPERSEDED");
  EXPECT_TRUE(absl::IsAborted(result_->status()));
}

TEST_F(LiveSolverTest, ACancelledSolveCallStopsWithinAnIteration) {
  Update update = hold_ends(rest(), 1, 8);
  update.settings.solver = SolveSettings{.method = Method::kLineSearch, .tolerance = 1e-12};
  ASSERT_TRUE(mailbox_.take(update).ok());
  const auto solve = job();
  ASSERT_TRUE(solver_.run_slice(solve.get()));
  const auto before = publisher_->newest();
  solve->finish(absl::CancelledError("enough"));
  EXPECT_FALSE(solver_.run_slice(solve.get()));
  EXPECT_EQ(publisher_->newest(), before);
  EXPECT_TRUE(absl::IsCancelled(result_->status()));
}

TEST_F(LiveSolverTest, AfterACancelledSolveCallTheReadersStillGetTheirResult) {
  Update update = hold_ends(rest(), 1, 3);
  ASSERT_TRUE(mailbox_.take(update).ok());
  const auto stream = look_on();
  const auto solve = job();
  solver_.run_slice(solve.get());
  solve->abandon();
  settle();
  EXPECT_TRUE(publisher_->newest()->is_final);
  EXPECT_EQ(publisher_->newest()->input_seq, 1u);
}

TEST_F(LiveSolverTest, ASolveCallNeedsHandles) {
  const auto solve = job();
  settle(solve.get());
  EXPECT_EQ(failure(), "NO_HANDLES");
  EXPECT_TRUE(absl::IsFailedPrecondition(result_->status()));
}

TEST_F(LiveSolverTest, InitialPositionsOfTheWrongSizeAreRefused) {
  ASSERT_TRUE(mailbox_.take(hold_ends(rest(), 1, 2)).ok());
  const auto solve = job({.initial_positions = Points::Zero(3, 3)});
  settle(solve.get());
  EXPECT_EQ(failure(), "POSITIONS_SIZE");
}

TEST_F(LiveSolverTest, SettingsWithoutHandlesLeaveTheSurfaceAsItIs) {
  const auto stream = look_on();
  Update update;
  update.input_seq = 1;
  update.settings.p = Field::Constant(1, 3.0);
  ASSERT_TRUE(mailbox_.take(update).ok());
  settle();
  EXPECT_TRUE(publisher_->newest()->is_final);
  EXPECT_EQ(publisher_->newest()->input_seq, 1u);
  EXPECT_FALSE(publisher_->standing());
}

/// Turns the top of the bar about its axis, and shifts it.
Update turn_tip(std::uint64_t input_seq, double share) {
  RigidMotion motion;
  motion.axis = {0, 0, 1};
  motion.angle_radians = 1.5 * share;
  motion.center = {2, 2, 21};
  motion.translation = {4 * share, 0, share};  // pulled: a pushed bar buckles, and then it jumps
  Update update;
  update.input_seq = input_seq;
  update.handles.push_back({"tip", motion});
  return update;
}

TEST_F(LiveSolverTest, ADragNeitherFlickersNorLeavesAnythingBehind) {
  constexpr int kMoves = 15;
  const auto tip = vertices_at(rest(), highest_z(rest()));
  const auto stream = look_on();
  const auto receive = [&] {
    while (const auto note = stream->next()) {
    }
    ASSERT_TRUE(stream->acknowledge(publisher_->newest()->frame_seq).ok());
  };
  std::uint64_t seq = 0;
  for (const double p : {1.0, 1.5, 2.0, 6.0}) {
    Update update = hold_ends(rest(), ++seq, 0);
    update.settings.p = Field::Constant(1, p);
    ASSERT_TRUE(mailbox_.take(update).ok());
    settle();
    double largest = 0;
    for (int k = 1; k <= 2 * kMoves; ++k) {
      receive();
      const auto before = publisher_->newest();
      ASSERT_TRUE(mailbox_.take(turn_tip(++seq, double(std::min(k, 2 * kMoves - k)) / kMoves)).ok());
      solver_.run_slice(nullptr);
      const auto first = publisher_->newest();
      ASSERT_EQ(first->input_seq, seq);
      const Points moved = first->surface->positions() - before->surface->positions();
      double of_handles = 0;
      for (const std::int32_t vertex : tip) of_handles = std::max(of_handles, moved.row(vertex).norm());
      EXPECT_LE(moved.rowwise().norm().maxCoeff(), 2 * of_handles) << "p = " << p << ", move " << k;
      settle();
      largest = std::max(largest, publisher_->newest()->energy);
    }
    EXPECT_TRUE(publisher_->newest()->is_final);
    EXPECT_LE(publisher_->newest()->energy, 1e-6 * largest) << "p = " << p;
  }
}

TEST_F(LiveSolverTest, AHastyDragBackToTheStartEndsAtRest) {
  constexpr int kMoves = 40;
  const auto stream = look_on();
  std::uint64_t seq = 0;
  for (const double p : {1.0, 1.5, 2.0, 6.0}) {
    Update update = hold_ends(rest(), ++seq, 0);
    update.settings.p = Field::Constant(1, p);
    ASSERT_TRUE(mailbox_.take(update).ok());
    settle();
    double largest = 0;
    for (int k = 1; k <= 2 * kMoves; ++k) {
      ASSERT_TRUE(mailbox_.take(turn_tip(++seq, double(std::min(k, 2 * kMoves - k)) / kMoves)).ok());
      solver_.run_slice(nullptr);  // the next input comes as soon as there is a frame
      largest = std::max(largest, publisher_->newest()->energy);
      while (const auto note = stream->next()) {
      }
      ASSERT_TRUE(stream->acknowledge(publisher_->newest()->frame_seq).ok());
    }
    settle();
    EXPECT_TRUE(publisher_->newest()->is_final);
    EXPECT_LE(publisher_->newest()->energy, 1e-6 * largest) << "p = " << p;
  }
}

/// A sheet so large that coarse levels lead its drags. Its right edge turns by three degrees with each move.
class LargeSheetTest : public LiveSolverTest {
 protected:
  static constexpr int kSide = 174;  // 30,625 vertices
  LargeSheetTest() : LiveSolverTest(grid(kSide, kSide, 2)) {}

  /// Makes 20 moves, with two slices each. The numbers of moves that were shown once and twice in the first one.
  std::pair<int, int> drag(double p, const LiveSolver::Pace& pace) {
    const auto stream = look_on();
    int once = 0, twice = 0;
    for (std::uint64_t number = 1; number <= 20; ++number) {
      Update update;
      update.input_seq = number;
      update.handles.push_back({"left", Handle{slice(0), Fixed{}}});
      const RigidMotion turn{Eigen::Vector3d::UnitY(),
                             -std::numbers::pi / 60 * static_cast<double>(number),
                             {0.5 * kSide, 0, 0},
                             {0, 0, 0}};
      update.handles.push_back({"right", Handle{slice(kSide), turn}});
      if (number == 1) update.settings.p = Field::Constant(1, p);
      EXPECT_TRUE(mailbox_.take(update).ok());
      const std::uint64_t before = publisher_->newest()->frame_seq;
      (void)solver_.run_slice(nullptr, pace);
      const auto frame = publisher_->newest();
      EXPECT_EQ(frame->input_seq, number);
      EXPECT_GE(frame->iteration, 1u);
      ++(frame->frame_seq == before + 1 ? once : twice);
      (void)solver_.run_slice(nullptr, pace);
      while (stream->next()) {
      }
      EXPECT_TRUE(stream->acknowledge(publisher_->newest()->frame_seq).ok());
    }
    return {once, twice};
  }

 private:
  std::vector<std::int32_t> slice(double x) const {
    std::vector<std::int32_t> found;
    for (Eigen::Index i = 0; i < rest().rows(); ++i) {
      if (rest()(i, 0) == x) found.push_back(static_cast<std::int32_t>(i));
    }
    return found;
  }
};

TEST_F(LargeSheetTest, AMoveThatCoarseLevelsLeadIsShownBeforeItsFirstIteration) {
  // After a move of six iterations the fine level would go on alone.
  const auto [once, twice] = drag(1.5, {.slice = LiveSolver::kOneStep});
  EXPECT_GE(twice, 15);
  EXPECT_GT(once, 0);  // the first move
}

TEST_F(LargeSheetTest, UnderOverloadEachMoveIsShownAfterAnIteration) {
  EXPECT_EQ(drag(1.5, {.slice = LiveSolver::kShortSlice, .is_sparing = true}).second, 0);
}

TEST_F(LargeSheetTest, AtALargePEachMoveIsShownAfterAnIteration) {
  EXPECT_EQ(drag(6, {}).second, 0);
}

class TwoBarsTest : public LiveSolverTest {
 protected:
  TwoBarsTest() : LiveSolverTest(two_bars_mesh()) {}
};

TEST_F(TwoBarsTest, AComponentWithoutAHandleIsAStandingFaultUntilItHasOne) {
  const auto stream = look_on();
  Update one;
  one.input_seq = 1;
  one.handles.push_back({"left", Handle{{0, 1}, shifted(0, 1, 0)}});
  ASSERT_TRUE(mailbox_.take(one).ok());
  settle();
  ASSERT_TRUE(publisher_->standing());
  const FaultNote fault = publisher_->standing()->fault;
  EXPECT_EQ(fault_of(fault.status).reason, "COMPONENT_WITHOUT_HANDLE");
  EXPECT_EQ(fault.input_seq, 1u);
  EXPECT_EQ(publisher_->newest()->input_seq, 0u);

  const auto solve = job();
  settle(solve.get());
  EXPECT_EQ(failure(), "COMPONENT_WITHOUT_HANDLE");

  Update other;
  other.input_seq = 2;
  const auto last = static_cast<std::int32_t>(rest().rows() - 1);
  other.handles.push_back({"right", Handle{{last}, Fixed{}}});
  ASSERT_TRUE(mailbox_.take(other).ok());
  settle();
  EXPECT_FALSE(publisher_->standing());
  EXPECT_EQ(publisher_->newest()->input_seq, 2u);
  EXPECT_TRUE(publisher_->newest()->is_final);
}

}  // namespace
}  // namespace lpdeform
