#include "core/multiresolution/graded_level.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "core/energy/cell_pass.h"
#include "core/methods/quasi_newton.h"
#include "tests/core/multiresolution/keeping_solver.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

/// A closed sheet that is folded at its middle: the rest of it only moves along.
class GradedLevelTest : public testing::Test {
 protected:
  const TriangleMesh mesh = box_surface(4, 36, 144);
  const std::shared_ptr<const RestShape> shape = rest_shape(mesh);

  HandleSet fold() const {
    HandleSet handles;
    (void)handles.set("bottom", {slice(mesh, 2, 0, 62), Fixed{}});
    (void)handles.set("top", {slice(mesh, 2, 82, 144), turn({1, 0.2, 0}, 80, {2, 18, 72})});
    return handles;
  }
  /// A solver whose cold solves have a graded level, or one whose solves have none.
  std::unique_ptr<Deformer> solver(const Material& material, bool is_graded, int threads = 1) const {
    DeformerOptions options{.threads = threads};
    if (is_graded) options.graded_from = 1000;
    return deformer(shape, fold(), material, options);
  }
  /// The whole sheet bends between its ends: the fine level has a long way to go, unless p is 2.
  HandleSet bend(double degrees = 80) const {
    HandleSet handles;
    (void)handles.set("bottom", {slice(mesh, 2, 0, 10), Fixed{}});
    (void)handles.set("top", {slice(mesh, 2, 134, 144), turn({1, 0.2, 0}, degrees, {2, 18, 72})});
    return handles;
  }
  /// A solver whose cold solves may have a late graded level.
  std::unique_ptr<Deformer> late_solver(const HandleSet& handles, double p,
                                        DeformerOptions options = {}) const {
    options.late_graded_from = 1000;
    return deformer(shape, handles, Material::uniform(p), options);
  }
  static SolveSettings settings() {
    SolveSettings result;
    result.method = Method::kMultiresolution;
    result.initial = InitialGuess::kLaplacian;
    result.effort = 0;
    result.keep_trace = true;
    return result;
  }
};

/// While a graded level runs, the fine level waits: its records have the same energy.
int waiting_records(const SolveSummary& summary) {
  int result = 0;
  for (std::size_t k = 1; k < summary.trace.size(); ++k) {
    if (summary.trace[k].stage > 0 && summary.trace[k].objective == summary.trace[k - 1].objective) ++result;
  }
  return result;
}

TEST_F(GradedLevelTest, RunsAfterTheFirstFineIterations) {
  for (const double p : {1.0, 1.5, 2.0}) {
    const SolveSummary with = solver(Material::uniform(p), true)->solve(settings()).value();
    const SolveSummary without = solver(Material::uniform(p), false)->solve(settings()).value();
    EXPECT_GT(waiting_records(with), 5) << "p = " << p;
    EXPECT_LT(waiting_records(without), 5) << "p = " << p;
  }
}

/// The stages in which the fine level waits for another level for more than five records.
int waiting_stages(const SolveSummary& summary) {
  std::map<int, int> records;
  for (std::size_t k = 1; k < summary.trace.size(); ++k) {
    if (summary.trace[k].stage > 0 && summary.trace[k].objective == summary.trace[k - 1].objective)
      ++records[summary.trace[k].stage];
  }
  return static_cast<int>(
      std::count_if(records.begin(), records.end(), [](const auto& stage) { return stage.second > 5; }));
}

TEST_F(GradedLevelTest, ComesLateWhereTheWayIsLong) {
  for (const double p : {1.0, 1.5}) {
    EXPECT_GT(waiting_records(late_solver(bend(), p)->solve(settings()).value()), 5) << "p = " << p;
    EXPECT_LT(waiting_records(late_solver(fold(), p)->solve(settings()).value()), 5) << "p = " << p;
    const auto without = deformer(shape, bend(), Material::uniform(p));
    EXPECT_LT(waiting_records(without->solve(settings()).value()), 5) << "p = " << p;
  }
  EXPECT_LT(waiting_records(late_solver(bend(), 6)->solve(settings()).value()), 5);
}

TEST_F(GradedLevelTest, ALateOneMayFollowAnEarlyOne) {
  DeformerOptions early{.graded_from = 1000};
  const HandleSet far = bend(120);  // where the early one leaves much to do
  EXPECT_EQ(waiting_stages(deformer(shape, far, Material::uniform(1.1), early)->solve(settings()).value()),
            1);
  EXPECT_EQ(waiting_stages(late_solver(far, 1.1, early)->solve(settings()).value()), 2);
}

TEST_F(GradedLevelTest, ALateOneEndsWhereASolveWithoutItEndsOrLower) {
  for (const double p : {1.0, 1.5}) {
    const SolveSummary with = late_solver(bend(), p)->solve(settings()).value();
    const SolveSummary without = deformer(shape, bend(), Material::uniform(p))->solve(settings()).value();
    EXPECT_EQ(with.stop_reason, StopReason::kConverged) << "p = " << p;
    EXPECT_GT(waiting_records(with), 5) << "p = " << p;
    EXPECT_LT(std::pow(with.energy / without.energy, 1 / p), 1.005) << "p = " << p;
  }
}

void expect_no_stage_goes_back_or_up(const SolveSummary& summary) {
  for (std::size_t k = 1; k < summary.trace.size(); ++k) {
    const IterationRecord &before = summary.trace[k - 1], &now = summary.trace[k];
    EXPECT_GE(now.stage, before.stage) << "record " << k;
    if (now.stage == before.stage) {
      EXPECT_LE(now.objective, before.objective * (1 + 1e-12)) << "record " << k;
    }
  }
}

TEST_F(GradedLevelTest, NoStageGoesBackOrUp) {
  for (const double p : {1.0, 1.5, 2.0, 6.0}) {
    SCOPED_TRACE(p);
    expect_no_stage_goes_back_or_up(solver(Material::uniform(p), true)->solve(settings()).value());
  }
  const DeformerOptions early{.graded_from = 1000};
  expect_no_stage_goes_back_or_up(late_solver(bend(120), 1.1, early)->solve(settings()).value());
  expect_no_stage_goes_back_or_up(late_solver(bend(), 1)->solve(settings()).value());
  expect_no_stage_goes_back_or_up(late_solver(bend(), 1.5)->solve(settings()).value());
}

/// Shares of one value and of one for each cell are told apart, even if the first is the same.
TEST_F(GradedLevelTest, ASolverTakesTheBendingOfEachCell) {
  Field shares = Field::Constant(shape->vertex_count(), 0.2);
  shares[0] = 1;
  const auto solver = deformer(shape, fold(), Material::uniform(2));
  solver->set_bending(shares);
  SolveSettings once = settings();
  once.method = Method::kQuasiNewton;
  once.max_iterations = 1;
  (void)solver->solve(once);
  CellPass cells(shape, Workers(1));
  cells.set_bending(shares);
  const double unit = shape->mean_edge_length();
  const double sum = cells.evaluate((solver->positions().rowwise() - shape->centre()) / unit,
                                    LpNorm(Material::uniform(2), shape->vertex_count(), 1, 1));
  EXPECT_NEAR(solver->cell_energies().squaredNorm(), unit * unit * sum, 1e-6 * sum);
  solver->set_bending(Field::Ones(1));
  (void)solver->solve(once);
  EXPECT_GT(solver->cell_energies().squaredNorm(), 1.01 * unit * unit * sum);
}

TEST_F(GradedLevelTest, AdmissionCountsWhatASolveTakes) {
  for (const double p : {2.0, 6.0}) {
    std::size_t admitted = 0;
    const auto admit = [&](std::size_t bytes) {
      admitted = bytes;
      return absl::OkStatus();
    };
    const auto solver = Deformer::create(shape, {.graded_from = 1000, .admit = admit}).value();
    ASSERT_TRUE(solver->set_handles(fold()).ok());
    ASSERT_TRUE(solver->set_material(Material::uniform(p)).ok());
    ASSERT_TRUE(solver->start(settings()).ok());
    std::size_t most = 0;
    while (solver->step()) most = std::max(most, solver->memory_bytes());
    EXPECT_LE(most, admitted) << "p = " << p;
  }
}

/// While it runs at a large p, the fine level needs no factor. Its memory is not promised to anybody else.
TEST_F(GradedLevelTest, TheFactorOfTheFineLevelIsFreedMeanwhileAtALargeP) {
  for (const double p : {1.0, 2.0, 6.0}) {
    const auto graded = solver(Material::uniform(p), true);
    ASSERT_TRUE(graded->start(settings()).ok());
    const auto before = static_cast<double>(graded->idle_memory_bytes());
    const std::size_t all_before = graded->memory_bytes();
    double least = before;
    while (graded->step()) {
      least = std::min(least, static_cast<double>(graded->idle_memory_bytes()));
      ASSERT_GE(graded->memory_bytes(), all_before) << "p = " << p;
    }
    if (p > 2)
      EXPECT_LT(least, before - 100.0 * shape->vertex_count());
    else
      EXPECT_EQ(least, before) << "p = " << p;
    EXPECT_GT(static_cast<double>(graded->idle_memory_bytes()), 0.99 * before) << "p = " << p;
  }
}

/// Solves that end while the factor is freed. Whatever comes next makes one.
class GradedLevelWithoutFactorTest : public GradedLevelTest {
 protected:
  std::unique_ptr<Deformer> without_factor(const Material& material) const {
    auto result = solver(material, true);
    EXPECT_TRUE(result->start(settings()).ok());
    const std::size_t before = result->idle_memory_bytes();
    while (result->idle_memory_bytes() >= before && result->step()) {
    }
    for (int k = 0; k < 12; ++k) EXPECT_TRUE(result->step());
    EXPECT_LT(result->idle_memory_bytes(), before);
    const std::size_t counted = result->memory_bytes();
    EXPECT_TRUE(result->set_handles(fold()).ok());  // ends the solve
    EXPECT_LT(result->idle_memory_bytes(), before);
    EXPECT_GE(result->memory_bytes(), before + QuasiNewton::kBytesPerVertex * shape->vertex_count());
    EXPECT_LE(result->memory_bytes(), counted);
    return result;
  }
  static double e(const SolveSummary& summary, double p) { return std::pow(summary.energy, 1 / p); }
  HandleSet moved() const {
    HandleSet result = fold();
    (void)result.set("top", {slice(mesh, 2, 82, 144), turn({1, 0.2, 0}, 81, {2, 18, 72})});
    return result;
  }
};

TEST_F(GradedLevelWithoutFactorTest, HandlesMayMove) {
  for (const double p : {3.0, 6.0}) {
    const auto live = without_factor(Material::uniform(p));
    ASSERT_TRUE(live->set_handles(moved()).ok());
    const SolveSummary summary = live->solve({.effort = 0, .certify = true}).value();
    EXPECT_EQ(summary.stop_reason, StopReason::kConverged) << "p = " << p;
    const auto cold = deformer(shape, moved(), Material::uniform(p));
    EXPECT_LT(e(summary, p) / e(cold->solve(settings()).value(), p), 1.01) << "p = " << p;
  }
}

TEST_F(GradedLevelWithoutFactorTest, OtherVerticesMayBeHeldSoftly) {
  const auto live = without_factor(Material::uniform(6));
  HandleSet handles = fold();
  Handle soft{slice(mesh, 2, 82, 144), turn({1, 0.2, 0}, 80, {2, 18, 72})};
  soft.hold = Soft{2};
  ASSERT_TRUE(handles.set("top", soft).ok());
  ASSERT_TRUE(live->set_handles(handles).ok());
  EXPECT_EQ(live->solve({.effort = 0}).value().stop_reason, StopReason::kConverged);
  EXPECT_TRUE(live->positions().allFinite());
}

TEST_F(GradedLevelWithoutFactorTest, PMayChange) {
  const auto live = without_factor(Material::uniform(6));
  ASSERT_TRUE(live->set_material(Material::uniform(1.5)).ok());
  const SolveSummary summary = live->solve({.effort = 0}).value();
  EXPECT_EQ(summary.stop_reason, StopReason::kConverged);
  const auto cold = deformer(shape, fold(), Material::uniform(1.5));
  EXPECT_LT(e(summary, 1.5) / e(cold->solve(settings()).value(), 1.5), 1.02);
}

TEST_F(GradedLevelWithoutFactorTest, ACertificateMayFollow) {
  SolveSettings until = settings();
  until.max_iterations = without_factor(Material::uniform(6))->summary().iterations;
  until.certify = true;
  const auto stopped = solver(Material::uniform(6), true);
  const SolveSummary summary = stopped->solve(until).value();
  EXPECT_EQ(summary.stop_reason, StopReason::kIterationLimit);
  ASSERT_TRUE(summary.optimality_gap);
  EXPECT_TRUE(std::isfinite(*summary.optimality_gap));
  EXPECT_GE(*summary.optimality_gap, 0);
}

/// With points, the factor stays: it moves the surface to where they are to be.
TEST_F(GradedLevelTest, PointsStayOnTheirTargetsWhileItRuns) {
  HandleSet handles = fold();
  std::int32_t face = 0;  // between the other handles
  while (std::abs(mesh.vertices(mesh.faces(face, 0), 2) - 72) > 2) ++face;
  Handle point;
  point.points = {{face, {0.2, 0.3, 0.5}}};
  ASSERT_TRUE(handles.set("point", point).ok());
  const Points target = rest_positions(point, mesh.vertices, mesh.faces);
  for (const double p : {2.0, 6.0}) {
    const auto graded = deformer(shape, handles, Material::uniform(p), {.graded_from = 1000});
    ASSERT_TRUE(graded->start(settings()).ok());
    const std::size_t before = graded->idle_memory_bytes();
    std::size_t most = 0;
    while (graded->step()) {
      ASSERT_GE(graded->idle_memory_bytes(), before) << "p = " << p;
      graded->catch_up(false);
      most = std::max(most, graded->memory_bytes() - graded->idle_memory_bytes());
      const Points now = graded->positions();
      ASSERT_TRUE(now.allFinite()) << "p = " << p;
      const auto& corners = mesh.faces;
      const Eigen::RowVector3d at =
          0.2 * now.row(corners(face, 0)) + 0.3 * now.row(corners(face, 1)) + 0.5 * now.row(corners(face, 2));
      ASSERT_LT((at - target.row(0)).norm(), 1e-9) << "p = " << p;
    }
    EXPECT_EQ(graded->summary().stop_reason, StopReason::kConverged) << "p = " << p;
    EXPECT_GT(most, QuasiNewton::kBytesPerVertex * shape->vertex_count()) << "no graded level, p = " << p;
  }
}

TEST_F(GradedLevelTest, AdmissionCountsWhatLargeLevelsTake) {
  for (const double p : {1.0, 1.5}) {
    for (const std::int32_t graded_from : {1000, 100000}) {
      std::size_t admitted = 0;
      const auto admit = [&](std::size_t bytes) {
        admitted = bytes;
        return absl::OkStatus();
      };
      const auto late = late_solver(bend(), p, {.graded_from = graded_from, .admit = admit});
      ASSERT_TRUE(late->start(settings()).ok());
      std::size_t most = 0;
      while (late->step()) most = std::max(most, late->memory_bytes());
      EXPECT_LE(most, admitted) << "p = " << p << ", graded from " << graded_from;
      EXPECT_GT(most, 1.2 * static_cast<double>(late->memory_bytes())) << "p = " << p;
    }
  }
}

/// At a large p it runs before them. Its iterations count.
TEST_F(GradedLevelTest, RunsBeforeTheFirstFineIterationsAtALargeP) {
  const auto waits_before = [](const SolveSummary& summary) {
    return std::count_if(summary.trace.begin(), summary.trace.end(), [&](const IterationRecord& record) {
      return record.stage == 0 && record.objective < 0.9 * summary.trace.front().objective;
    });
  };
  EXPECT_GT(waits_before(solver(Material::uniform(6), true)->solve(settings()).value()), 5);
  EXPECT_LT(waits_before(solver(Material::uniform(6), false)->solve(settings()).value()), 5);
}

TEST_F(GradedLevelTest, EndsWhereASolveWithoutItEndsOrLower) {
  for (const double p : {1.0, 1.5, 2.0, 6.0}) {
    const SolveSummary with = solver(Material::uniform(p), true)->solve(settings()).value();
    const SolveSummary without = solver(Material::uniform(p), false)->solve(settings()).value();
    EXPECT_EQ(with.stop_reason, StopReason::kConverged) << "p = " << p;
    EXPECT_LT(std::pow(with.energy / without.energy, 1 / p), 1.005) << "p = " << p;
  }
}

TEST_F(GradedLevelTest, GivesTheSameBitsOnAnyNumberOfThreads) {
  for (const double p : {1.5, 2.0, 6.0}) {
    std::vector<Points> results;
    for (const int threads : {1, 3}) {
      const auto deformer =
          Deformer::create(shape, {.threads = threads, .vertices_a_thread = 1, .graded_from = 1000}).value();
      ASSERT_TRUE(deformer->set_handles(fold()).ok());
      ASSERT_TRUE(deformer->set_material(Material::uniform(p)).ok());
      (void)deformer->solve(settings());
      results.push_back(deformer->positions());
    }
    EXPECT_EQ(results[0], results[1]) << "p = " << p;
  }
  std::vector<Points> results;
  for (const int threads : {1, 3}) {
    const auto late = late_solver(bend(), 1.5, {.threads = threads, .vertices_a_thread = 1});
    EXPECT_GT(waiting_records(late->solve(settings()).value()), 5);
    results.push_back(late->positions());
  }
  EXPECT_EQ(results[0], results[1]);
}

TEST_F(GradedLevelTest, ALookAtItDoesNotChangeWhatFollows) {
  const auto alone = solver(Material::uniform(2), true), watched = solver(Material::uniform(2), true);
  (void)alone->solve(settings());
  ASSERT_TRUE(watched->start(settings()).ok());
  for (int step = 0; watched->step(); ++step) {
    watched->catch_up(step % 3 == 0);
    ASSERT_TRUE(watched->positions().allFinite());
  }
  EXPECT_EQ(alone->positions(), watched->positions());
  EXPECT_EQ(alone->summary().iterations, watched->summary().iterations);
}

TEST_F(GradedLevelTest, StoppedWhileItRunsASolveHasAStateOfItsEnergy) {
  const SolveSummary whole = solver(Material::uniform(2), true)->solve(settings()).value();
  const auto waits = [&](std::size_t k) {
    return whole.trace[k].stage > 0 && whole.trace[k].objective == whole.trace[k - 1].objective;
  };
  std::size_t first = 1;
  while (first < whole.trace.size() && !waits(first)) ++first;
  ASSERT_LT(first, whole.trace.size());
  for (const int more : {0, 3, 8}) {
    SolveSettings until = settings();
    until.max_iterations = whole.trace[first].iteration + more;
    const auto stopped = solver(Material::uniform(2), true);
    const SolveSummary summary = stopped->solve(until).value();
    EXPECT_EQ(summary.stop_reason, StopReason::kIterationLimit);
    EXPECT_NEAR(stopped->cell_energies().squaredNorm(), summary.energy, 1e-9 * summary.energy);
    EXPECT_LE(summary.energy, whole.trace[first].energy);
    for (const std::int32_t v : slice(mesh, 2, 0, 62))
      EXPECT_EQ(stopped->positions().row(v), mesh.vertices.row(v));
  }
}

TEST_F(GradedLevelTest, StoppedWhileALateOneRunsASolveHasAStateOfItsEnergy) {
  const SolveSummary whole = late_solver(bend(), 1.5)->solve(settings()).value();
  const auto waits = [&](std::size_t k) {
    return whole.trace[k].stage > 0 && whole.trace[k].objective == whole.trace[k - 1].objective;
  };
  std::size_t first = 1;
  while (first + 10 < whole.trace.size() && !(waits(first) && waits(first + 10))) ++first;
  ASSERT_LT(first + 10, whole.trace.size());
  for (const int more : {0, 10, 40}) {
    SolveSettings until = settings();
    until.max_iterations = whole.trace[first].iteration + more;
    const auto stopped = late_solver(bend(), 1.5);
    const SolveSummary summary = stopped->solve(until).value();
    EXPECT_EQ(summary.stop_reason, StopReason::kIterationLimit);
    EXPECT_NEAR(stopped->cell_energies().array().pow(1.5).sum(), summary.energy, 1e-9 * summary.energy);
    EXPECT_LE(summary.energy, whole.trace[first].energy);
  }
}

TEST_F(GradedLevelTest, KnowsOtherHandles) {
  HandleSet handles;
  ASSERT_TRUE(handles.set("bottom", {slice(mesh, 2, 0, 62), Fixed{}}).ok());
  Handle soft{slice(mesh, 2, 120, 144), turn({1, 0.2, 0}, 80, {2, 18, 72})};
  soft.hold = Soft{2};
  ASSERT_TRUE(handles.set("top", soft).ok());
  const auto solve = [&](bool is_graded) {
    DeformerOptions options;
    if (is_graded) options.graded_from = 1000;
    return deformer(shape, handles, Material::uniform(2), options)->solve(settings()).value();
  };
  EXPECT_LT(std::sqrt(solve(true).energy / solve(false).energy), 1.005);
}

/// The level itself, below which is a coarse level that has solved the same.
TEST_F(GradedLevelTest, HasTheVerticesWhereTheDistortionIs) {
  std::shared_ptr<const RestShape> graded;
  Field bending;
  const MakeLevelSolver make = [&](std::shared_ptr<const RestShape> level) -> std::unique_ptr<LevelSolver> {
    graded = level;
    return std::make_unique<KeepingSolver>(*level, &bending);
  };
  const auto coarse = CoarseLevel::create(*shape, CoarseLevel::coarsened(*shape), make);
  const Constraints constraints = make_constraints(*shape, fold(), FreeComponents::kError).value();
  const HandleSet handles = fold();
  const Material material = Material::uniform(2);
  const FineInputs inputs{*shape, handles, constraints, material, 1};
  std::vector<double> squared(shape->vertex_count(), 1e-6);
  std::int32_t distorted = 0;
  for (std::size_t v = 0; v < squared.size(); ++v) {
    if (std::abs(mesh.vertices(static_cast<Eigen::Index>(v), 2) - 72) < 6) squared[v] = 1, ++distorted;
  }
  const Points& x = shape->scaled_positions();
  const std::vector<char> stays = GradedLevel::chosen(*coarse, squared, 2);
  ASSERT_FALSE(stays.empty());
  const auto level = GradedLevel::create(inputs, x, stays, make, {});
  ASSERT_NE(level, nullptr);
  EXPECT_GE(graded->vertex_count(), distorted);
  const auto kept_whole = std::count(stays.begin(), stays.end(), 1);
  EXPECT_LT(graded->vertex_count(), kept_whole + 0.06 * static_cast<double>(squared.size()));
  std::int32_t kept = 0, coarse_there = 0;
  double stands_for = 0;  // a cell that stands for m fine cells keeps 1 / m of its resistance to bending
  ASSERT_EQ(bending.size(), graded->vertex_count());
  for (std::int32_t c = 0; c < graded->vertex_count(); ++c) {
    stands_for += 1 / bending[c];
    if (std::abs(graded->positions()(c, 2) - 72) < 6) ++(bending[c] >= 0.5 ? kept : coarse_there);
  }
  EXPECT_GE(kept, 0.8 * distorted);
  EXPECT_LE(coarse_there, 0.01 * distorted);  // those beyond 80 % of the distortion, a twentieth of them
  EXPECT_NEAR(stands_for, shape->vertex_count(), 1e-6 * stands_for);
  EXPECT_EQ(level->moved(*shape, x, Workers(1)).rows(), x.rows());

  EXPECT_TRUE(GradedLevel::chosen(*coarse, std::vector<double>(squared.size(), 0.0), 2).empty());
  EXPECT_EQ(GradedLevel::create(inputs, x, stays, [](auto) { return nullptr; }, {}), nullptr);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_EQ(GradedLevel::create(inputs, x, stays, make, stop.get_token()), nullptr);
}

}  // namespace
}  // namespace lpdeform
