// Drags of meshes so large that each move has time for few iterations only: coarse levels lead them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

/// A bumpy sheet whose right edge turns by three degrees with each move.
class LedDragTest : public testing::TestWithParam<double> {
 protected:
  static constexpr int kSide = 174;  // 30,625 vertices

  LedDragTest() { EXPECT_TRUE(live->solve({}).ok()); }

  HandleSet bent(double moves) const {
    HandleSet handles;
    (void)handles.set("left", {slice(mesh, 0, 0, 0), Fixed{}});
    (void)handles.set("right", {right, turn(Eigen::Vector3d::UnitY(), -3.0 * moves, {0.5 * kSide, 0, 0},
                                            {0, 0, 0.2 * kSide / 30 * moves})});
    return handles;
  }
  static SolveSummary solve(Deformer& deformer, int max_iterations) {
    SolveSettings settings{.max_iterations = max_iterations, .effort = 0};
    settings.keep_trace = true;
    return deformer.solve(settings).value();
  }
  SolveSummary move(int number, int max_iterations = 1) const {
    EXPECT_TRUE(live->set_handles(bent(number)).ok());
    return solve(*live, max_iterations);
  }
  /// E^(1/p) over that of the minimum which the live state comes to when the drag has ended.
  double above_minimum(const SolveSummary& summary) const {
    return std::pow(summary.energy / solve(*live, 1000).energy, 1 / GetParam());
  }

  const TriangleMesh mesh = grid(kSide, kSide, 2);
  const std::vector<std::int32_t> right = slice(mesh, 0, kSide, kSide);
  const std::shared_ptr<const RestShape> shape = rest_shape(mesh);
  const std::unique_ptr<Deformer> live = deformer(shape, bent(0), Material::uniform(GetParam()));
};

/// Without coarse levels that lead, it is 9.7, 9.2 and 18 times the minimum after 12 such moves.
TEST_P(LedDragTest, KeepsNearTheMinimum) {
  for (int number = 1; number < 12; ++number) (void)move(number);
  const SolveSummary last = move(12);
  EXPECT_LE(above_minimum(last), GetParam() == 6 ? 1.6 : 1.2);
}

/// On a slow machine a move may come before the first iteration of the move before. The ratio was 2.8, 2.8 and 3.4 when coarse levels
/// led only after an iteration.
TEST_P(LedDragTest, KeepsNearTheMinimumAlsoWithoutAnyIteration) {
  for (int number = 1; number < 12; ++number) (void)move(number, 0);
  EXPECT_LE(above_minimum(move(12, 0)), GetParam() == 6 ? 3 : 1.4);
}

/// On straight lines it was over 1.05 at each p, and 1.6 at p = 6.
TEST_P(LedDragTest, AGuessIsNearTheMinimumWhereMovesConverge) {
  for (int number = 1; number < 6; ++number) (void)move(number, 1000);
  EXPECT_LE(above_minimum(move(6, 0)), 1.05);
}

TEST_P(LedDragTest, FramesDoNotJump) {
  Points before;
  double farthest = 0, of_handle = 0;
  for (int number = 1; number <= 8; ++number) {
    (void)move(number);
    const Points now = live->positions();
    if (number > 3) {  // the sheet has left its rest shape
      farthest = std::max(farthest, (now - before).rowwise().norm().maxCoeff());
      of_handle =
          std::max(of_handle, (rows_of(now, right) - rows_of(before, right)).rowwise().norm().maxCoeff());
    }
    before = now;
  }
  EXPECT_LE(farthest, 1.5 * of_handle);
}

INSTANTIATE_TEST_SUITE_P(Norms, LedDragTest, testing::Values(1.5, 2.0, 6.0));

class LedDragOfLowPTest : public LedDragTest {};

/// At p = 2 the fine level goes on alone; its guess and two iterations take as long as a guess that coarse levels lead. At p = 1.5 the
/// ratio was 1.33 when a coarse level did not lead the move after one of a dozen fine iterations.
TEST_P(LedDragOfLowPTest, IsSoonNearTheMinimumWhereMovesHaveTime) {
  const int soon = GetParam() == 2 ? 2 : 0;
  for (int number = 1; number < 10; ++number) (void)move(number, 20);
  double most = 0;
  for (int number = 10; number <= 12; ++number) {
    const SolveSummary summary = move(number, 20);
    most = std::max(most, std::pow(summary.trace[soon].energy / summary.energy, 1 / GetParam()));
  }
  EXPECT_LE(most, 1.1);
}

/// So that a frame need not wait for the first iteration, which takes a fifth of the time until then.
TEST_P(LedDragOfLowPTest, AGuessThatIsSmoothIsNearTheStateAfterAnIteration) {
  int smooth = 0;
  double most = 0;
  for (int number = 1; number <= 12; ++number) {
    ASSERT_TRUE(live->set_handles(bent(number)).ok());
    ASSERT_TRUE(live->start({.max_iterations = 1, .effort = 0}).ok());
    if (!live->is_guess_smooth()) {
      (void)live->step();
      continue;
    }
    const double shown = live->summary().energy;
    (void)live->step();
    most = std::max(most, std::pow(shown / live->summary().energy, 1 / GetParam()));
    ++smooth;
  }
  EXPECT_GT(smooth, 0);
  EXPECT_LE(most, 1.1);
}

TEST_P(LedDragOfLowPTest, NoGuessIsSmoothOnceTheHandlesStay) {
  bool was_smooth = false;
  for (int number = 1; number <= 12 && !was_smooth; ++number) {
    (void)move(number);
    was_smooth = live->is_guess_smooth();
  }
  EXPECT_TRUE(was_smooth);
  ASSERT_TRUE(live->start({.effort = 0}).ok());
  EXPECT_FALSE(live->is_guess_smooth());
}

/// At p = 2 it was 1.21 when guesses went along straight lines, and coarse levels led after a move without iterations.
TEST_P(LedDragOfLowPTest, StaysNearWithoutIterationsOnceItIsNear) {
  for (int number = 1; number < 8; ++number) (void)move(number, 20);
  for (int number = 8; number < 11; ++number) (void)move(number, 0);
  EXPECT_LE(above_minimum(move(11, 0)), GetParam() == 2 ? 1.1 : 1.2);
}

/// The coarse levels have stayed behind meanwhile, and have to be moved first. At p = 2 1.9 times the minimum, were they not.
TEST_P(LedDragOfLowPTest, IsLedOnAfterMovesThatItMadeAlone) {
  for (int number = 1; number <= 8; ++number) (void)move(number, 20);
  for (int number = 12; number <= 24; number += 4) (void)move(number, 1);
  EXPECT_LE(above_minimum(move(25)), 1.3);
}

INSTANTIATE_TEST_SUITE_P(LowNorms, LedDragOfLowPTest, testing::Values(1.5, 2.0));

class LedDragBelowTwoTest : public LedDragTest {};

/// Then the guess is the fine level's own, which is never shown before an iteration at p < 2. At p = 1.2 the surface needs one move more.
TEST_P(LedDragBelowTwoTest, GoesAloneAfterMovesThatHadTime) {
  for (int number = 1; number < 10; ++number) (void)move(number, 2);
  (void)move(10, 20);
  EXPECT_TRUE(live->is_guess_smooth());
  if (GetParam() < 1.5) (void)move(11, 6);
  for (int number = GetParam() < 1.5 ? 12 : 11; number < 16; ++number) {
    (void)move(number, 6);
    EXPECT_FALSE(live->is_guess_smooth()) << number;
  }
}

INSTANTIATE_TEST_SUITE_P(BelowTwo, LedDragBelowTwoTest, testing::Values(1.2, 1.5));

class LedDragAtOneAndAHalfTest : public LedDragTest {};

/// What the surface had over the lowest level's energy at one p tells nothing at another one.
TEST_P(LedDragAtOneAndAHalfTest, IsLedAgainAfterAChangeOfP) {
  for (int number = 1; number < 10; ++number) (void)move(number, 20);
  EXPECT_FALSE(live->is_guess_smooth());
  ASSERT_TRUE(live->set_material(Material::uniform(1.6)).ok());
  for (int number = 10; number < 16; ++number) (void)move(number, 2);
  EXPECT_TRUE(live->is_guess_smooth());
}

/// The lowest level is at other handles then, and at another p. What is found too high must not let the surface fall behind.
TEST_P(LedDragAtOneAndAHalfTest, IsLedAfterAChangeOfPAlsoWhereTheFirstMoveHasTime) {
  ASSERT_TRUE(live->set_material(Material::uniform(2)).ok());
  for (int number = 1; number < 10; ++number) (void)move(number, 20);
  ASSERT_TRUE(live->set_material(Material::uniform(1.5)).ok());
  (void)move(10, 20);
  for (int number = 11; number < 16; ++number) (void)move(number, 2);
  const SolveSummary last = move(16, 2);
  EXPECT_TRUE(live->is_guess_smooth());
  EXPECT_LE(above_minimum(last), 1.08);
}

/// In a drag that waits for each move until it is within 5 %. The minimum of each is that of a second solver. Some guesses were 2.1 times
/// the minimum where coarse levels led although they were up to twice as high at p = 2 as the fine level's own guess.
TEST_P(LedDragAtOneAndAHalfTest, GuessesAreNearTheMinimumWhereMovesWait) {
  const auto converged = deformer(shape, bent(0), Material::uniform(GetParam()));
  (void)converged->solve({});
  double most = 0;
  for (int number = 1; number <= 12; ++number) {
    ASSERT_TRUE(converged->set_handles(bent(number)).ok());
    ASSERT_TRUE(live->set_handles(bent(number)).ok());
    ASSERT_TRUE(live->start({.effort = 0}).ok());
    const double least = solve(*converged, 1000).energy;
    if (number > 3) most = std::max(most, std::pow(live->summary().energy / least, 1 / GetParam()));
    while (std::pow(live->summary().energy / least, 1 / GetParam()) > 1.05 && live->step()) {
    }
  }
  EXPECT_LE(most, 1.5);
}

TEST_P(LedDragAtOneAndAHalfTest, GivesTheSameBitsOnAnyNumberOfThreads) {
  auto other = deformer(shape, bent(0), Material::uniform(1.5), {.threads = 2});
  (void)other->solve({});
  for (int number = 1; number <= 6; ++number) {
    (void)move(number, 8);
    ASSERT_TRUE(other->set_handles(bent(number)).ok());
    (void)solve(*other, 8);
  }
  EXPECT_FALSE(live->is_guess_smooth());  // alone
  EXPECT_EQ(live->positions(), other->positions());
}

INSTANTIATE_TEST_SUITE_P(AtOneAndAHalf, LedDragAtOneAndAHalfTest, testing::Values(1.5));

class LedDragAtSixTest : public LedDragTest {};

/// 3.7 times the minimum, where kinks of the guesses are not eased.
TEST_P(LedDragAtSixTest, ItsFirstMovesHaveFewKinks) {
  for (int number = 1; number < 4; ++number) {
    (void)move(number);
    EXPECT_FALSE(live->is_guess_smooth());
  }
  EXPECT_LE(above_minimum(move(4)), 3.2);
}

INSTANTIATE_TEST_SUITE_P(AtSix, LedDragAtSixTest, testing::Values(6.0));

class LedDragAtTwoTest : public LedDragTest {};

/// Where E^(1/2) of the guess is at most a tenth above that of the state before. From the seventh to the eighth move that of the minimum
/// rises by an eighth, and from the 13th on by less than a tenth.
TEST_P(LedDragAtTwoTest, ShowsTheGuessesThatItMakesAlone) {
  for (int number = 1; number < 8; ++number) (void)move(number, 20);
  (void)move(8, 20);
  EXPECT_FALSE(live->is_guess_smooth());
  for (int number = 9; number < 14; ++number) (void)move(number, 20);
  for (int number = 14; number < 18; ++number) {
    (void)move(number, 1);
    EXPECT_TRUE(live->is_guess_smooth()) << number;
  }
}

/// Where cells have different stiffness, soft ones have most of the sum of E_i^2. The sum then tells little about stiff ones.
TEST_P(LedDragAtTwoTest, ShowsNoGuessOfAMeshWithStiffParts) {
  Material material = Material::uniform(2);
  material.stiffness = Field::Ones(shape->vertex_count());
  material.stiffness.head(shape->vertex_count() / 2).setConstant(2);
  ASSERT_TRUE(live->set_material(material).ok());
  for (int number = 1; number < 18; ++number) {
    (void)move(number, 20);
    EXPECT_FALSE(live->is_guess_smooth()) << number;
  }
}

TEST_P(LedDragAtTwoTest, IsAtTheMinimumWhereMovesHaveTimeForThreeIterations) {
  for (int number = 1; number < 12; ++number) (void)move(number, 3);
  EXPECT_LE(above_minimum(move(12, 3)), 1.1);
}

TEST_P(LedDragAtTwoTest, GivesTheSameBitsOnAnyNumberOfThreads) {
  auto other = deformer(shape, bent(0), Material::uniform(2), {.threads = 2});
  (void)other->solve({});
  for (int number = 1; number <= 3; ++number) {
    (void)move(number);
    ASSERT_TRUE(other->set_handles(bent(number)).ok());
    (void)solve(*other, 1);
  }
  EXPECT_EQ(live->positions(), other->positions());
}

/// The coarse levels have been where the surface is not.
TEST_P(LedDragAtTwoTest, GoesOnFromPositionsThatWereSet) {
  for (int number = 1; number <= 4; ++number) (void)move(number);
  (void)solve(*live, 1000);
  const Points undone = live->positions();
  for (int number = 5; number <= 12; ++number) (void)move(number);
  ASSERT_TRUE(live->set_positions(undone).ok());
  for (int number = 5; number < 8; ++number) (void)move(number);
  EXPECT_LE(above_minimum(move(8)), 1.2);
}

/// The shape for another p is the fine level's own. It must not come a second time, from the coarse levels.
TEST_P(LedDragAtTwoTest, GoesOnAfterAChangeOfP) {
  for (int number = 1; number <= 8; ++number) (void)move(number);
  ASSERT_TRUE(live->set_material(Material::uniform(1.5)).ok());
  const double energy = solve(*live, 1000).energy;
  ASSERT_TRUE(live->set_material(Material::uniform(2)).ok());
  (void)solve(*live, 1000);
  ASSERT_TRUE(live->set_material(Material::uniform(1.5)).ok());
  EXPECT_LE(solve(*live, 1000).energy, 1.01 * energy);
  for (int number = 9; number < 12; ++number) (void)move(number);
  const double last = move(12).energy;
  EXPECT_LE(std::pow(last / solve(*live, 1000).energy, 1 / 1.5), 1.3);
}

TEST_P(LedDragAtTwoTest, ComesBackToRest) {
  for (const int number : {1, 2, 3, 2, 1}) (void)move(number);
  (void)move(0, 600);
  EXPECT_LE((live->positions() - mesh.vertices).rowwise().norm().maxCoeff(), 1e-5 * kSide);
}

TEST_P(LedDragAtTwoTest, ACancelledMoveLeavesAFiniteStateAndTheNextGoesOn) {
  (void)move(1);
  std::stop_source stop;
  stop.request_stop();
  ASSERT_TRUE(live->set_handles(bent(2)).ok());
  ASSERT_TRUE(live->solve({.effort = 0}, stop.get_token()).ok());
  EXPECT_TRUE(live->positions().allFinite());
  for (int number = 3; number < 8; ++number) (void)move(number);
  EXPECT_LE(above_minimum(move(8)), 1.2);
}

// What the fine level has done alone must not come a second time, from the coarse levels.

/// 86 times the minimum, were it so.
TEST_P(LedDragAtTwoTest, AHandleThatIsGoneLeavesNoMotionBehind) {
  const auto with_patch = [&](int number) {
    HandleSet handles = bent(number);
    (void)handles.set("patch", {slice(mesh, 0, kSide / 2, kSide / 2),
                                turn(Eigen::Vector3d::UnitY(), 0, {0, 0, 0}, {0, 0, 0.05 * kSide * number})});
    return handles;
  };
  for (int number = 1; number <= 4; ++number) {
    ASSERT_TRUE(live->set_handles(with_patch(number)).ok());
    (void)solve(*live, 2);
  }
  ASSERT_TRUE(live->set_handles(bent(4)).ok());
  (void)solve(*live, 300);
  EXPECT_LE(above_minimum(move(5, 2)), 2);
}

/// It would move by as much as in settling.
TEST_P(LedDragAtTwoTest, ASettledSurfaceMovesAsLittleAsItsHandle) {
  for (int number = 1; number <= 10; number += 3) (void)move(number);
  (void)solve(*live, 1000);
  const Points settled = live->positions();
  (void)move(11);
  const Points moved = live->positions() - settled;
  EXPECT_LE(moved.rowwise().norm().maxCoeff(), 2 * rows_of(moved, right).rowwise().norm().maxCoeff());
}

/// 7 times the minimum, were the unfinished coarse state taken for that of the surface.
TEST_P(LedDragAtTwoTest, ACutColdSolveIsForgottenOnceTheSurfaceHasConverged) {
  auto cut = deformer(shape, bent(15), Material::uniform(2));
  SolveSettings cold{.initial = InitialGuess::kLaplacian, .max_iterations = 3, .effort = 0};
  ASSERT_TRUE(cut->solve(cold).ok());
  const double settled = solve(*cut, 1000).energy;
  ASSERT_TRUE(cut->set_handles(bent(15.1)).ok());
  EXPECT_LE(std::sqrt(solve(*cut, 2).energy / settled), 1.2);
}

INSTANTIATE_TEST_SUITE_P(AtTwo, LedDragAtTwoTest, testing::Values(2.0));

}  // namespace
}  // namespace lpdeform
