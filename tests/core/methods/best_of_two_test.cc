#include "core/methods/best_of_two.h"

#include <gmock/gmock.h>

#include "core/shapes/paper_poses.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

SolveSettings cold(Method method) {
  SolveSettings result;
  result.method = method;
  result.initial = InitialGuess::kLaplacian;
  result.keep_trace = true;
  return result;
}

/// Shapes on which, at p = 1, now the one method ends lower and now the other.
struct Bent {
  TriangleMesh mesh;
  HandleSet handles;
};

Bent bar(double degrees) {
  Bent result{box_surface(6, 6, 40), {}};
  (void)result.handles.set("bottom", {slice(result.mesh, 2, 0, 0), Fixed{}});
  (void)result.handles.set(
      "top", {slice(result.mesh, 2, 40, 40), turn(Eigen::Vector3d::UnitX(), degrees, {3, 3, 20})});
  return result;
}

Bent sheet(double size) {
  const PaperPose pose = paper_sheet(size);
  return {pose.mesh, pose.handles};
}

Bent lifted_grid(double height) {
  Bent result{grid(30, 30, 1.0), {}};
  (void)result.handles.set("corner", {{0, 1, 31}, Fixed{}});
  (void)result.handles.set("lifted", {{960}, RigidMotion{.translation = {0, 0, height}}});
  return result;
}

class BestOfTwoTest : public testing::Test {
 protected:
  static SolveSummary solve(const Bent& bent, const SolveSettings& settings) {
    return deformer(rest_shape(bent.mesh), bent.handles, Material::uniform(1))->solve(settings).value();
  }
};

TEST_F(BestOfTwoTest, AutoEndsAsLowAsTheBetterMethod) {
  int first_is_lower = 0, second_is_lower = 0;
  for (const Bent& bent : {sheet(0.5), lifted_grid(5)}) {
    const SolveSummary one = solve(bent, cold(Method::kQuasiNewton));
    const SolveSummary other = solve(bent, cold(Method::kMultiresolution));
    const SolveSummary both = solve(bent, cold(Method::kAuto));
    EXPECT_LE(both.energy, 1.001 * std::min(one.energy, other.energy));
    EXPECT_EQ(both.stop_reason, StopReason::kConverged);
    EXPECT_EQ(both.method, both.energy < one.energy ? Method::kMultiresolution : Method::kQuasiNewton);
    if (one.energy < 0.996 * other.energy) ++first_is_lower;
    if (other.energy < 0.996 * one.energy) ++second_is_lower;
  }
  EXPECT_EQ(first_is_lower, 1);
  EXPECT_EQ(second_is_lower, 1);
}

TEST_F(BestOfTwoTest, StagesAndTrueEnergiesFollowOneAnother) {
  const SolveSummary both = solve(bar(120), cold(Method::kAuto));
  double lowest = both.initial_energy;
  int stage = 0;
  for (const IterationRecord& record : both.trace) {
    EXPECT_GE(record.stage, stage);
    stage = record.stage;
    lowest = std::min(lowest, record.energy);
  }
  EXPECT_EQ(lowest, both.energy);
  EXPECT_EQ(both.trace.back().energy, both.energy);
}

TEST_F(BestOfTwoTest, ALimitAfterTheFirstHasConvergedLeavesItsResult) {
  const Bent bent = bar(80);
  const SolveSummary one = solve(bent, cold(Method::kQuasiNewton));
  SolveSettings few = cold(Method::kAuto);
  few.max_iterations = one.iterations + 5;
  const SolveSummary both = solve(bent, few);
  EXPECT_EQ(both.stop_reason, StopReason::kConverged);
  EXPECT_LE(both.energy, one.energy);
  few.max_iterations = one.iterations - 5;
  EXPECT_EQ(solve(bent, few).stop_reason, StopReason::kIterationLimit);
}

// Where the second is the better one already and not at its end, that is no convergence, though the first had converged.
TEST_F(BestOfTwoTest, ALimitAfterTheSecondIsTheBetterSaysThatItIsNotAtItsEnd) {
  const Bent bent = sheet(0.5);
  const SolveSummary one = solve(bent, cold(Method::kQuasiNewton));
  const SolveSummary both = solve(bent, cold(Method::kAuto));
  ASSERT_EQ(both.method, Method::kMultiresolution);
  SolveSettings few = cold(Method::kAuto);
  few.max_iterations = both.iterations - 5;
  const SolveSummary cut = solve(bent, few);
  ASSERT_LT(cut.energy, one.energy);
  ASSERT_GT(cut.energy, both.energy);
  EXPECT_EQ(cut.stop_reason, StopReason::kIterationLimit);
  EXPECT_EQ(cut.method, Method::kMultiresolution);
}

TEST_F(BestOfTwoTest, ADragGoesOnFromTheBetterWithoutASecond) {
  Bent bent = bar(80);
  auto solver = deformer(rest_shape(bent.mesh), bent.handles, Material::uniform(1));
  (void)solver->solve(cold(Method::kAuto)).value();
  (void)bent.handles.set_motion("top", turn(Eigen::Vector3d::UnitX(), 81, {3, 3, 20}));
  ASSERT_TRUE(solver->set_handles(bent.handles).ok());
  const Points before = solver->positions();
  SolveSettings warm = cold(Method::kAuto);
  warm.initial = InitialGuess::kCurrent;
  EXPECT_EQ(solver->solve(warm).value().method, Method::kQuasiNewton);
  EXPECT_LT((solver->positions() - before).rowwise().norm().maxCoeff(), 3);  // the handle moved by 0.5
}

TEST_F(BestOfTwoTest, IsTheSameEachTime) {
  auto a = deformer(rest_shape(bar(80).mesh), bar(80).handles, Material::uniform(1));
  auto b = deformer(rest_shape(bar(80).mesh), bar(80).handles, Material::uniform(1));
  (void)a->solve(cold(Method::kAuto));
  (void)b->solve(cold(Method::kAuto));
  EXPECT_EQ(a->positions(), b->positions());
}

}  // namespace
}  // namespace lpdeform
