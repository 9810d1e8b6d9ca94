#include "core/methods/minima_search.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <utility>

#include "core/base/fault.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

SolveSettings cold(std::optional<int> effort = std::nullopt) {
  SolveSettings result;
  result.effort = effort;
  result.initial = InitialGuess::kLaplacian;
  result.keep_trace = true;
  return result;
}

/// The first minimum of bar(80) is 2.8 % above the lowest one known, p = 1.5.
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

Bent lifted_grid(double height) {
  Bent result{grid(30, 30, 1.0), {}};
  (void)result.handles.set("corner", {{0, 1, 31}, Fixed{}});
  (void)result.handles.set("lifted", {{960}, RigidMotion{.translation = {0, 0, height}}});
  return result;
}

class MinimaSearchTest : public testing::Test {
 protected:
  static std::unique_ptr<Deformer> solver_of(const Bent& bent, int threads = 1) {
    auto result =
        Deformer::create(rest_shape(bent.mesh), {.threads = threads, .vertices_a_thread = 1}).value();
    EXPECT_TRUE(result->set_handles(bent.handles).ok());
    EXPECT_TRUE(result->set_material(Material::uniform(1.5)).ok());
    return result;
  }
  static SolveSummary solve(const Bent& bent, const SolveSettings& settings) {
    return solver_of(bent)->solve(settings).value();
  }
  /// A bar after a solve with this least share and one search.
  static std::unique_ptr<Deformer> searched(double least_share) {
    auto solver = solver_of(bar(80));
    SolveSettings settings = cold(0);
    settings.standing.least_share = least_share;
    (void)solver->solve(settings).value();
    EXPECT_TRUE(solver->start_search(1).ok());
    run(*solver);
    return solver;
  }
  static void run(Deformer& deformer) {
    while (deformer.step()) {
    }
  }
};

TEST_F(MinimaSearchTest, EffortZeroTakesTheFirstMinimum) {
  const SolveSummary first = solve(bar(80), cold(0));
  EXPECT_THAT(first.minima, testing::ElementsAre(first.energy));
  EXPECT_EQ(first.further_starts, 0);
}

TEST_F(MinimaSearchTest, TheDefaultEndsInALowerMinimum) {
  for (const Bent& bent : {bar(80), bar(120), lifted_grid(5)}) {
    const SolveSummary first = solve(bent, cold(0)), lowest = solve(bent, cold());
    EXPECT_LE(lowest.energy, first.energy);
    EXPECT_EQ(lowest.stop_reason, StopReason::kConverged);
    EXPECT_EQ(lowest.further_starts, 12);
    EXPECT_EQ(lowest.minima.front(), first.energy);
    EXPECT_EQ(lowest.energy, std::ranges::min(lowest.minima));
  }
  EXPECT_LT(solve(bar(80), cold()).energy, 0.98 * solve(bar(80), cold(0)).energy);
}

TEST_F(MinimaSearchTest, TheEnergyIsThatOfThePositions) {
  const auto solver = solver_of(bar(80));
  const SolveSummary summary = solver->solve(cold()).value();
  EXPECT_NEAR(solver->cell_energies().array().pow(1.5).sum(), summary.energy, 1e-9 * summary.energy);
}

TEST_F(MinimaSearchTest, StagesAndTrueEnergiesFollowOneAnother) {
  const SolveSummary summary = solve(bar(80), cold());
  int stage = 0;
  for (const IterationRecord& record : summary.trace) {
    EXPECT_GE(record.stage, stage);
    stage = record.stage;
  }
  EXPECT_EQ(summary.trace.back().energy, summary.energy);
}

TEST_F(MinimaSearchTest, ALimitDuringTheSearchLeavesTheFirstMinimum) {
  const Bent bent = bar(80);
  const SolveSummary first = solve(bent, cold(0));
  SolveSettings few = cold();
  few.max_iterations = first.iterations + 5;
  const SolveSummary cut = solve(bent, few);
  EXPECT_EQ(cut.stop_reason, StopReason::kConverged);
  EXPECT_EQ(cut.energy, first.energy);
  few.max_iterations = first.iterations - 5;
  const SolveSummary before = solve(bent, few);
  EXPECT_EQ(before.stop_reason, StopReason::kIterationLimit);
  EXPECT_TRUE(before.minima.empty());
}

TEST_F(MinimaSearchTest, ADragGoesOnWithoutASearch) {
  Bent bent = bar(80);
  auto solver = solver_of(bent);
  (void)solver->solve(cold()).value();
  (void)bent.handles.set_motion("top", turn(Eigen::Vector3d::UnitX(), 81, {3, 3, 20}));
  ASSERT_TRUE(solver->set_handles(bent.handles).ok());
  const Points before = solver->positions();
  SolveSettings warm = cold();
  warm.initial = InitialGuess::kCurrent;
  EXPECT_EQ(solver->solve(warm).value().further_starts, 0);
  EXPECT_LT((solver->positions() - before).rowwise().norm().maxCoeff(), 3);  // the handle moved by 0.5
}

TEST_F(MinimaSearchTest, IsTheSameOnAnyNumberOfThreads) {
  const Bent bent{grid(66, 66, 1.0), lifted_grid(5).handles};  // more vertices than a chunk has
  const auto one = solver_of(bent, 1), two = solver_of(bent, 2);
  SolveSettings settings = cold();
  settings.max_iterations = 3000;
  const SolveSummary first = one->solve(settings).value(), second = two->solve(settings).value();
  EXPECT_GT(first.further_starts, 0);
  EXPECT_EQ(one->positions(), two->positions());
  EXPECT_EQ(first.minima, second.minima);
  EXPECT_EQ(first.further_starts, second.further_starts);
}

TEST_F(MinimaSearchTest, AnEffortBelowZeroOrOverTheLimitIsRefused) {
  const auto solver = solver_of(bar(80));
  for (const int effort : {-1, 1001}) {
    const absl::Status status = solver->solve(cold(effort)).status();
    EXPECT_EQ(fault_of(status).reason, "EFFORT_OUT_OF_RANGE");
    EXPECT_EQ(fault_of(status).limit, "0 <= effort <= 1000");
  }
}

TEST_F(MinimaSearchTest, ASearchApartChangesNothingUntilItsResultIsTaken) {
  const auto solver = solver_of(bar(80));
  const SolveSummary first = solver->solve(cold(0)).value();
  const Points before = solver->positions();
  ASSERT_TRUE(solver->start_search(1).ok());
  EXPECT_TRUE(solver->is_searching());
  run(*solver);
  EXPECT_FALSE(solver->is_searching());
  EXPECT_EQ(solver->positions(), before);
  EXPECT_EQ(solver->summary().energy, first.energy);
  ASSERT_TRUE(solver->better_energy().has_value());
  const double better = *solver->better_energy();
  EXPECT_LT(better, 0.98 * first.energy);
  ASSERT_TRUE(solver->take_better());
  EXPECT_EQ(solver->summary().energy, better);
  EXPECT_NE(solver->positions(), before);
  EXPECT_NEAR(solver->cell_energies().array().pow(1.5).sum(), better, 1e-9 * better);
  EXPECT_FALSE(solver->take_better());
}

TEST_F(MinimaSearchTest, ASecondSearchGoesOnWithOtherStarts) {
  const auto solver = solver_of(lifted_grid(5));
  (void)solver->solve(cold(0)).value();
  ASSERT_TRUE(solver->start_search(1).ok());
  run(*solver);
  const std::vector<double> after_one = solver->summary().minima;
  EXPECT_EQ(solver->summary().further_starts, 12);
  ASSERT_TRUE(solver->start_search(1).ok());
  run(*solver);
  EXPECT_EQ(solver->summary().further_starts, 24);
  EXPECT_GE(solver->summary().minima.size(), after_one.size());
}

TEST_F(MinimaSearchTest, AShapeThatIsReservedIsTakenWhateverIsFoundLater) {
  const auto solver = searched(0);
  const double first = solver->better_energy().value_or(0);
  ASSERT_GT(first, 0);
  solver->reserve_better();
  EXPECT_FALSE(solver->better_energy().has_value());
  ASSERT_TRUE(solver->start_search(1).ok());
  run(*solver);
  // A later start comes to the same minimum by another way, and is lower in the last digits.
  EXPECT_NEAR(solver->better_energy().value_or(first), first, 1e-4 * first);
  ASSERT_TRUE(solver->start_search(1).ok());
  ASSERT_TRUE(solver->take_better());  // which ends that search
  EXPECT_FALSE(solver->is_searching());
  EXPECT_EQ(solver->summary().energy, first);
}

TEST_F(MinimaSearchTest, AMinimumThatSavesTooLittleIsNotBetterButTheNextSearchGoesOnFromIt) {
  const auto solver = searched(0.9);
  EXPECT_FALSE(solver->better_energy().has_value());
  EXPECT_FALSE(solver->take_better());
  const auto other = searched(0);
  for (Deformer* const one : {solver.get(), other.get()}) {
    ASSERT_TRUE(one->start_search(1).ok());
    run(*one);
  }
  EXPECT_EQ(solver->summary().minima, other->summary().minima);
}

TEST_F(MinimaSearchTest, OnceAShapeIsReservedAnotherIsBetterOnlyIfItSavesTheLeastShareMore) {
  const auto solver = searched(0.001);
  solver->reserve_better();
  ASSERT_TRUE(solver->start_search(1).ok());
  run(*solver);
  EXPECT_FALSE(solver->better_energy().has_value());
}

TEST_F(MinimaSearchTest, NewInputsForgetWhatWasFound) {
  Bent bent = bar(80);
  const auto solver = solver_of(bent);
  (void)solver->solve(cold(0)).value();
  ASSERT_TRUE(solver->start_search(1).ok());
  for (int k = 0; k < 50; ++k) (void)solver->step();
  ASSERT_TRUE(solver->set_handles(bent.handles).ok());
  EXPECT_FALSE(solver->is_searching());
  EXPECT_FALSE(solver->better_energy().has_value());
  EXPECT_EQ(fault_of(solver->start_search(1)).reason, "NOT_SOLVED");
}

/// A minimiser that ends at once, with the true sum 1. Counts those that are there.
class Instant : public Minimiser {
 public:
  Instant(int& alive, Points x) : alive_(alive), x_(std::move(x)) { ++alive_; }
  ~Instant() override { --alive_; }
  StepResult step() override { return {Outcome::kConverged, 1, 0, 1}; }
  const Points& x() const override { return x_; }

 private:
  int& alive_;
  const Points x_;
};

/// A search of three starts that end at once in `ends`, from a minimum at a line of three vertices.
struct ThreeStarts {
  static Points line(double bend) { return Points{{0, 0, 0}, {1, bend, 0}, {2, 0, 0}}; }

  ThreeStarts(double first_sum, const Points& ends)
      : search([this, ends](int, const Points&) { return make(ends); },
               [this](Points x) { return make(std::move(x)); }, {.starts = 3, .most_iterations = 10}, line(0),
               first_sum) {
    while (search.step()) {
    }
  }
  std::unique_ptr<Minimiser> make(Points x) {
    EXPECT_EQ(alive, 0);  // two of them would take twice the memory
    ++made;
    return std::make_unique<Instant>(alive, std::move(x));
  }

  int alive = 0, made = 0;
  MinimaSearch search;
};

TEST_F(MinimaSearchTest, AStartThatComesBackToTheLowestMinimumIsNotMinimisedFurther) {
  const ThreeStarts same(0.99995, ThreeStarts::line(0.9));
  EXPECT_EQ(same.made, 3);
  EXPECT_THAT(same.search.minima(), testing::ElementsAre(0.99995, 0.99995, 0.99995));
  EXPECT_FALSE(same.search.has_improved());
}

TEST_F(MinimaSearchTest, AStartThatIsLowerIsMinimisedFurtherHoweverNearItIs) {
  const ThreeStarts lower(1.00005, ThreeStarts::line(0.9));
  EXPECT_EQ(lower.made, 4);  // a rough one and a finishing one; the others come back to where that has ended
  EXPECT_THAT(lower.search.minima(), testing::ElementsAre(1, 1, 1));
  EXPECT_EQ(lower.search.lowest_sum(), 1);
}

TEST_F(MinimaSearchTest, AnotherShapeOfTheSameEnergyIsMinimisedFurther) {
  const ThreeStarts other(1, ThreeStarts::line(1.1));
  EXPECT_EQ(other.made, 6);
  EXPECT_THAT(other.search.minima(), testing::ElementsAre(1, 1, 1));
}

TEST_F(MinimaSearchTest, AHigherEnergyIsMinimisedFurtherHoweverNearTheShapeIs) {
  const ThreeStarts higher(0.9998, ThreeStarts::line(0.9));
  EXPECT_EQ(higher.made, 6);
  EXPECT_THAT(higher.search.minima(), testing::ElementsAre(1, 1, 1));
}

TEST_F(MinimaSearchTest, AMoveAfterASearchThatFoundNothingIsAsWithoutOne) {
  const auto move = [](bool searches, int most_iterations) {
    const auto solver = solver_of(lifted_grid(5));
    SolveSettings settings = cold(0);
    settings.standing.least_share = 0;
    (void)solver->solve(settings).value();
    const absl::Status status = searches ? solver->start_search(1) : absl::OkStatus();
    EXPECT_TRUE(status.ok());
    run(*solver);
    // At most another end at the same minimum, as near as two solves to the same tolerance come: a start ends 6e-8 lower without
    // CHOLMOD, and 2e-6 with Eigen 5.
    const double first = solver->summary().energy;
    EXPECT_GT(solver->better_energy().value_or(first), (1 - 1e-5) * first);
    EXPECT_TRUE(solver->set_handles(lifted_grid(5.1).handles).ok());
    return solver->solve({.max_iterations = most_iterations}).value();
  };
  // Warm solves keep the metric that they find for ten iterations.
  for (const bool searches : {false, true}) EXPECT_EQ(move(searches, 9).factorisations, 0) << searches;
  const SolveSummary without = move(false, 1000), with = move(true, 1000);
  EXPECT_EQ(with.stop_reason, StopReason::kConverged);
  EXPECT_LE(with.iterations, 1.2 * without.iterations);  // the metrics are not the same to the last bit
  EXPECT_NEAR(with.energy, without.energy, 1e-5 * without.energy);
}

TEST_F(MinimaSearchTest, ALargeMeshIsSearchedOnItsCoarseLevels) {
  const Bent bent = bar(80);
  auto solver = Deformer::create(rest_shape(bent.mesh), {.search_up_to = 1000}).value();
  ASSERT_TRUE(solver->set_handles(bent.handles).ok());
  ASSERT_TRUE(solver->set_material(Material::uniform(1.5)).ok());
  SolveSettings first = cold(0);
  first.method = Method::kQuasiNewton;
  (void)solver->solve(first).value();
  const Points before = solver->positions();
  ASSERT_TRUE(solver->start_search(1).ok());
  EXPECT_TRUE(solver->is_searching());
  run(*solver);
  EXPECT_EQ(solver->positions(), before);
  EXPECT_EQ(solver->summary().further_starts, 1);
  EXPECT_FALSE(solver->has_other_starts());
  EXPECT_TRUE(solver_of(bent)->has_other_starts());
}

TEST_F(MinimaSearchTest, UnderAnyLimitItIsNoWorseThanTheFirstMinimum) {
  const Bent bent{box_surface(14, 14, 90), {}};
  Bent large = bent;
  (void)large.handles.set("bottom", {slice(bent.mesh, 2, 0, 0), Fixed{}});
  (void)large.handles.set("top",
                          {slice(bent.mesh, 2, 90, 90), turn(Eigen::Vector3d::UnitX(), 80, {7, 7, 45})});
  ASSERT_GT(bent.mesh.vertices.rows(), 5000);  // a coarse level comes first
  const int whole = solve(large, cold(0)).iterations;
  for (const int most : {whole / 3, whole, 2 * whole}) {
    SolveSettings first = cold(0), searching = cold(1);
    first.max_iterations = searching.max_iterations = most;
    EXPECT_LE(solve(large, searching).energy, solve(large, first).energy) << most;
  }
}

TEST_F(MinimaSearchTest, ASolveOfALargeMeshSearchesItsCoarseLevels) {
  const Bent bent = bar(80);
  auto solver = Deformer::create(rest_shape(bent.mesh), {.search_up_to = 1000}).value();
  ASSERT_TRUE(solver->set_handles(bent.handles).ok());
  ASSERT_TRUE(solver->set_material(Material::uniform(1.5)).ok());
  for (const Method method : {Method::kAuto, Method::kMultiresolution}) {
    SolveSettings settings = cold(1);
    settings.method = method;
    const SolveSummary summary = solver->solve(settings).value();
    EXPECT_EQ(summary.further_starts, 1);
    EXPECT_EQ(summary.effort, 1);
    EXPECT_GT(summary.search_iterations, 0);
    EXPECT_LT(summary.search_iterations, summary.iterations);
    EXPECT_EQ(summary.energy, std::ranges::min(summary.minima));
  }
}

TEST_F(MinimaSearchTest, TheSummarySaysWhatTheSearchWas) {
  const SolveSummary none = solve(bar(80), cold(0)), usual = solve(bar(80), cold());
  EXPECT_EQ(none.effort, 0);
  EXPECT_EQ(none.search_iterations, 0);
  EXPECT_EQ(usual.effort, 1);
  EXPECT_EQ(usual.iterations - usual.search_iterations, none.iterations);
  // Starts that ended far above the lowest are not listed.
  EXPECT_LT(std::ranges::max(usual.minima), 1.05 * usual.energy);
}

}  // namespace
}  // namespace lpdeform
