// What holds for every method, in one suite.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

struct Case {
  Method method;
  double p;  // -1: p = 1 and 2 by halves
};

Material material_of(double p, const TriangleMesh& mesh) {
  if (p > 0) return Material::uniform(p);
  Material material;
  const double middle = mesh.vertices.col(2).mean();
  material.p = Field::Ones(mesh.vertices.rows());
  for (const std::int32_t i : slice(mesh, 2, middle, 1e9)) material.p[i] = 2;
  return material;
}

class EveryMethod : public testing::TestWithParam<Case> {
 protected:
  SolveSettings settings() const {
    SolveSettings result;
    result.method = GetParam().method;
    result.initial = InitialGuess::kLaplacian;
    result.max_iterations = GetParam().method == Method::kLineSearch ? 400 : 100000;
    result.keep_trace = true;
    return result;
  }
  std::unique_ptr<Deformer> make(const TriangleMesh& mesh, const HandleSet& handles,
                                 DeformerOptions options = {}) const {
    return deformer(rest_shape(mesh), handles, material_of(GetParam().p, mesh), options);
  }

  const TriangleMesh bar = box_surface(2, 2, 10);
  HandleSet twist(double degrees) const {
    HandleSet handles;
    (void)handles.set("bottom", {slice(bar, 2, 0, 0), Fixed{}});
    (void)handles.set("top", {slice(bar, 2, 10, 10), turn(Eigen::Vector3d::UnitZ(), degrees, {1, 1, 0})});
    return handles;
  }
};

TEST_P(EveryMethod, NeverRaisesItsObjectiveWithinAStageNorTheBestEnergy) {
  auto deformer = make(bar, twist(80));
  const SolveSummary summary = deformer->solve(settings()).value();
  ASSERT_GT(summary.trace.size(), 2u);
  double best = summary.trace[0].energy;
  for (std::size_t k = 1; k < summary.trace.size(); ++k) {
    const IterationRecord &before = summary.trace[k - 1], &now = summary.trace[k];
    best = std::min(best, now.energy);
    if (k > 1 && now.stage == before.stage) {
      // Sums of some 100 terms: rounding moves them by a few units in the last place.
      EXPECT_LE(now.objective, before.objective * (1 + 1e-13)) << "iteration " << k;
    }
    EXPECT_GE(now.stage, before.stage);
    EXPECT_GE(now.seconds, before.seconds);
  }
  EXPECT_LE(summary.energy, best * (1 + 1e-13));
  EXPECT_LT(summary.energy, summary.initial_energy);
}

TEST_P(EveryMethod, ReportsTheEnergyOfWhatItReturns) {
  auto deformer = make(bar, twist(80));
  const SolveSummary summary = deformer->solve(settings()).value();
  const Material material = material_of(GetParam().p, bar);
  const double l = deformer->shape().mean_edge_length();
  double sum = 0;
  for (Eigen::Index i = 0; i < bar.vertices.rows(); ++i) {
    const double energy = deformer->cell_energies()[i];
    sum += GetParam().p > 0 ? std::pow(energy, GetParam().p) : l * l * std::pow(energy / l, material.p[i]);
  }
  EXPECT_NEAR(summary.energy, sum, 1e-10 * sum);
}

TEST_P(EveryMethod, KeepsHandlesAtTheirTargets) {
  auto deformer = make(bar, twist(80));
  ASSERT_TRUE(deformer->solve(settings()).ok());
  const HandleSet handles = twist(80);
  for (const auto& [name, handle] : handles.handles()) {
    const Points targets = target_positions(handle, bar.vertices);
    for (std::size_t k = 0; k < handle.vertices.size(); ++k) {
      EXPECT_LT((deformer->positions().row(handle.vertices[k]) - targets.row(k)).norm(), 1e-13);
    }
  }
}

TEST_P(EveryMethod, GivesARigidMotionBack) {
  const RigidMotion motion = turn({1, 1, 0}, 130, {1, 2, 3}, {4, -1, 2});
  HandleSet handles;
  (void)handles.set("bottom", {slice(bar, 2, 0, 0), motion});
  (void)handles.set("top", {slice(bar, 2, 10, 10), motion});
  std::vector<std::int32_t> all(bar.vertices.rows());
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::int32_t>(i);
  const Points expected = target_positions({all, motion}, bar.vertices);
  auto deformer = make(bar, handles);
  ASSERT_TRUE(deformer->set_positions(expected).ok());
  SolveSettings from_there = settings();
  from_there.initial = InitialGuess::kCurrent;
  const SolveSummary summary = deformer->solve(from_there).value();
  EXPECT_EQ(summary.stop_reason, StopReason::kConverged);
  EXPECT_LT((deformer->positions() - expected).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT(deformer->cell_energies().maxCoeff(), 1e-12);
}

TEST_P(EveryMethod, StaysAtRestWhereNothingMoves) {
  auto deformer = make(bar, twist(0));
  const SolveSummary summary = deformer->solve(settings()).value();
  EXPECT_EQ(summary.stop_reason, StopReason::kConverged);
  EXPECT_LT((deformer->positions() - bar.vertices).cwiseAbs().maxCoeff(), 1e-12);
}

TEST_P(EveryMethod, GivesTheSameBitsOnAnyNumberOfThreads) {
  const TriangleMesh mesh = box_surface(4, 8, 30);  // several chunks
  HandleSet handles;
  (void)handles.set("bottom", {slice(mesh, 2, 0, 0), Fixed{}});
  (void)handles.set("top", {slice(mesh, 2, 30, 30), turn(Eigen::Vector3d::UnitZ(), 60, {2, 4, 0})});
  SolveSettings few = settings();
  few.max_iterations = 12;
  auto one = make(mesh, handles, {.threads = 1, .vertices_a_thread = 1});
  ASSERT_TRUE(one->solve(few).ok());
  for (const int threads : {2, 4}) {
    auto several = make(mesh, handles, {.threads = threads, .vertices_a_thread = 1});
    ASSERT_TRUE(several->solve(few).ok());
    EXPECT_EQ(several->positions(), one->positions()) << threads << " threads";
  }
}

TEST(QuasiNewton, HasAtMostOneThreadForEachThousandVertices) {
  const auto threads_of = [](int nx, int ny, int most) {
    const TriangleMesh mesh = grid(nx, ny, 2);
    HandleSet handles;
    (void)handles.set("left", {slice(mesh, 0, 0, 0), Fixed{}});
    return deformer(rest_shape(mesh), handles, Material::uniform(2), {.threads = most})
        ->solve({})
        .value()
        .threads;
  };
  EXPECT_EQ(threads_of(9, 9, 8), 1);    // 100 vertices
  EXPECT_EQ(threads_of(26, 73, 8), 1);  // 1,998
  EXPECT_EQ(threads_of(39, 49, 8), 2);  // 2,000
  EXPECT_EQ(threads_of(49, 99, 8), 5);  // 5,000
  EXPECT_EQ(threads_of(49, 99, 3), 3);
}

// Large enough for factorisations and back-substitutions by several threads.
TEST(QuasiNewton, GivesTheSameBitsOnAnyNumberOfThreadsWhereItsMetricIsShared) {
  const int side = 140;
  const TriangleMesh mesh = grid(side, side, 2);
  const auto shape = rest_shape(mesh);
  HandleSet handles;
  (void)handles.set("left", {slice(mesh, 0, 0, 0), Fixed{}});
  (void)handles.set("right",
                    {slice(mesh, 0, side, side), turn(Eigen::Vector3d::UnitY(), -70, {side / 2.0, 0, 0})});
  for (const double p : {1.0, 6.0}) {
    const SolveSettings few{
        .method = Method::kQuasiNewton, .initial = InitialGuess::kLaplacian, .max_iterations = 15};
    auto one = deformer(shape, handles, Material::uniform(p), {.threads = 1});
    ASSERT_TRUE(one->solve(few).ok());
    auto several = deformer(shape, handles, Material::uniform(p), {.threads = 3});
    ASSERT_TRUE(several->solve(few).ok());
    EXPECT_EQ(several->positions(), one->positions()) << "p = " << p;
  }
}

// Differences of positions then keep some six digits, and no program is solved to a gap of 1e-8.
TEST(Conic, EndsAProgramWhereRoundingLetsItGetNoFurther) {
  const TriangleMesh bar = box_surface(4, 4, 21);
  HandleSet handles;
  (void)handles.set("bottom", {slice(bar, 2, 0, 0), Fixed{}});
  (void)handles.set("top", {slice(bar, 2, 21, 21), Fixed{}});
  (void)handles.set("middle", {slice(bar, 2, 10, 11), RigidMotion{.translation = {1e-9, 2e-9, -1e-9}}});
  SolveSettings settings;
  settings.method = Method::kConic;
  settings.initial = InitialGuess::kLaplacian;
  settings.max_iterations = 1000;
  const SolveSummary summary =
      deformer(rest_shape(bar), handles, Material::uniform(1))->solve(settings).value();
  // By how much the last program is short of its gap depends on the factorisation.
  EXPECT_TRUE(summary.stop_reason == StopReason::kConverged ||
              summary.stop_reason == StopReason::kNumericalBreakdown)
      << stop_reason_name(summary.stop_reason);
  EXPECT_LT(summary.iterations, 200);
  EXPECT_LT(summary.energy, summary.initial_energy);
}

// A step of L-BFGS has one gradient: it takes one back-substitution, and one evaluation where the full step is accepted. A fresh
// metric takes one more, for the last pair.
TEST(QuasiNewton, WastesNoWork) {
  const TriangleMesh bar = box_surface(4, 4, 20);
  HandleSet handles;
  (void)handles.set("bottom", {slice(bar, 2, 0, 0), Fixed{}});
  (void)handles.set("top", {slice(bar, 2, 20, 20), turn(Eigen::Vector3d::UnitX(), 60, {2, 2, 10})});
  for (const double p : {1.0, 1.5, 2.0, 6.0}) {
    auto solver = deformer(rest_shape(bar), handles, Material::uniform(p));
    ASSERT_TRUE(solver->start({.method = Method::kQuasiNewton, .initial = InitialGuess::kLaplacian}).ok());
    int steps = 0, full = 0, fresh = 0;
    SolveSummary before = solver->summary();
    while (solver->step()) {
      const SolveSummary& now = solver->summary();
      const int evaluations = now.evaluations - before.evaluations;
      const int back_substitutions = now.back_substitutions - before.back_substitutions;
      ASSERT_GE(evaluations, 1) << "iteration " << now.iterations;
      ASSERT_GE(back_substitutions, 1) << "iteration " << now.iterations;
      ASSERT_LE(back_substitutions, 2) << "iteration " << now.iterations;
      ++steps;
      if (evaluations == 1) ++full;
      if (back_substitutions == 2) ++fresh;
      before = now;
    }
    EXPECT_GT(full, 0.8 * steps) << "p = " << p;
    EXPECT_LT(fresh, 0.2 * steps) << "p = " << p;
  }
}

TEST_P(EveryMethod, ChangesNothingButUnitsUnderScaleAndTranslation) {
  SolveSettings few = settings();
  // Before a coarse level is looked at: where collapses tie, rounding decides which vertices that has, and
  // InvarianceTest has its energies.
  few.max_iterations = 7;
  auto at_one = make(bar, twist(80));
  ASSERT_TRUE(at_one->solve(few).ok());
  for (const double scale : {1e-4, 1e4}) {
    const Eigen::RowVector3d offset = scale * Eigen::RowVector3d(1000, -2000, 500);
    TriangleMesh mesh = bar;
    mesh.vertices = (scale * bar.vertices).rowwise() + offset;
    HandleSet handles;
    const Eigen::Vector3d center = scale * Eigen::Vector3d(1, 1, 0) + offset.transpose();
    (void)handles.set("bottom", {slice(bar, 2, 0, 0), Fixed{}});
    (void)handles.set("top", {slice(bar, 2, 10, 10), turn(Eigen::Vector3d::UnitZ(), 80, center)});
    auto scaled = deformer(rest_shape(mesh), handles, material_of(GetParam().p, bar));
    ASSERT_TRUE(scaled->solve(few).ok());
    // Input coordinates were rounded at 2000 times the edge: 1e-13 of it, and the iterations amplify that.
    const Points back = (scaled->positions().rowwise() - offset) / scale;
    EXPECT_LT((back - at_one->positions()).cwiseAbs().maxCoeff(), 1e-6) << scale;
    EXPECT_LT((scaled->cell_energies() / scale - at_one->cell_energies()).cwiseAbs().maxCoeff(), 1e-6)
        << scale;
  }
}

TEST_P(EveryMethod, StopsAtEveryLimit) {
  auto deformer = make(bar, twist(80));
  SolveSettings limited = settings();
  limited.max_iterations = 3;
  SolveSummary summary = deformer->solve(limited).value();
  EXPECT_EQ(summary.stop_reason, StopReason::kIterationLimit);
  EXPECT_EQ(summary.iterations, 3);

  limited = settings();
  limited.time_limit_seconds = 1e-9;
  summary = deformer->solve(limited).value();
  EXPECT_EQ(summary.stop_reason, StopReason::kTimeLimit);
  EXPECT_EQ(summary.iterations, 0);
  EXPECT_TRUE(deformer->positions().allFinite());

  std::stop_source source;
  ASSERT_TRUE(deformer->start(settings(), source.get_token()).ok());
  EXPECT_TRUE(deformer->step());
  source.request_stop();
  EXPECT_FALSE(deformer->step());
  EXPECT_EQ(deformer->summary().stop_reason, StopReason::kCancelled);
  EXPECT_EQ(deformer->summary().iterations, 1);
}

std::string case_name(const testing::TestParamInfo<Case>& info) {
  std::string name(method_name(info.param.method));
  name.erase(std::remove(name.begin(), name.end(), '_'), name.end());
  if (info.param.p < 0) return name + "Mixed";
  return name + testing::PrintToString(static_cast<int>(10 * info.param.p));
}

INSTANTIATE_TEST_SUITE_P(Methods, EveryMethod,
                         testing::Values(Case{Method::kQuasiNewton, 1}, Case{Method::kQuasiNewton, 1.5},
                                         Case{Method::kQuasiNewton, 2}, Case{Method::kQuasiNewton, 6},
                                         Case{Method::kQuasiNewton, -1}, Case{Method::kLineSearch, 1.5},
                                         Case{Method::kLineSearch, 2}, Case{Method::kLineSearch, 6},
                                         Case{Method::kLineSearch, -1}, Case{Method::kLocalGlobal, 2},
                                         Case{Method::kConic, 1}, Case{Method::kMultiresolution, 1},
                                         Case{Method::kMultiresolution, 2}, Case{Method::kMultiresolution, 6},
                                         Case{Method::kMultiresolution, -1}),
                         case_name);

}  // namespace
}  // namespace lpdeform
