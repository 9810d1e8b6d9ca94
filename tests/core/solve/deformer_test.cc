#include "core/solve/deformer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "core/base/fault.h"
#include "tests/core/poses.h"
#include "tests/support/glued_shape.h"

namespace lpdeform {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

class DeformerTest : public testing::Test {
 protected:
  const TriangleMesh bar = box_surface(2, 2, 8);
  const std::shared_ptr<const RestShape> shape = rest_shape(bar);

  HandleSet ends(double degrees) const {
    HandleSet handles;
    (void)handles.set("bottom", {slice(bar, 2, 0, 0), Fixed{}});
    (void)handles.set("top", {slice(bar, 2, 8, 8), turn(Eigen::Vector3d::UnitX(), degrees, {1, 1, 4})});
    return handles;
  }
};

TEST_F(DeformerTest, BeginsAtRest) {
  auto solver = Deformer::create(shape, {}).value();
  EXPECT_EQ(solver->positions(), bar.vertices);
  EXPECT_EQ(solver->cell_energies().maxCoeff(), 0);
  EXPECT_FALSE(solver->step());
  EXPECT_EQ(fault_of(solver->start_certificate()).reason, "NOT_SOLVED");
}

TEST_F(DeformerTest, RefusesBadSettingsAndNamesThem) {
  auto solver = deformer(shape, ends(30), Material::uniform(1.5));
  const auto reason = [&](auto change) {
    SolveSettings settings;
    change(settings);
    return fault_of(solver->start(settings)).reason;
  };
  EXPECT_EQ(reason([](auto& s) { s.tolerance = 0; }), "TOLERANCE_OUT_OF_RANGE");
  EXPECT_EQ(reason([](auto& s) { s.tolerance = kNan; }), "TOLERANCE_OUT_OF_RANGE");
  EXPECT_EQ(reason([](auto& s) { s.max_iterations = -1; }), "ITERATIONS_OUT_OF_RANGE");
  EXPECT_EQ(reason([](auto& s) { s.time_limit_seconds = 0; }), "TIME_LIMIT_OUT_OF_RANGE");
  EXPECT_EQ(reason([](auto& s) { s.method = Method::kLocalGlobal; }), "METHOD_NEEDS_P");
  EXPECT_EQ(reason([](auto& s) { s.method = Method::kConic; }), "METHOD_NEEDS_P");
  EXPECT_EQ(fault_of(Deformer::create(shape, {.threads = 0}).status()).reason, "THREADS_OUT_OF_RANGE");
  EXPECT_EQ(fault_of(Deformer::create(nullptr, {}).status()).reason, "NO_SHAPE");
  EXPECT_EQ(fault_of(Deformer::create(shape, {}).value()->start({})).reason, "NO_HANDLES");
}

TEST_F(DeformerTest, RefusalsGiveValuesThatAreJustOutsideExactly) {
  auto solver = deformer(shape, ends(30), Material::uniform(1.5));
  const auto text = [](const absl::Status& status) { return std::string(status.message()); };
  EXPECT_EQ(text(solver->set_material(Material::uniform(64.0000001))),
            "p is 64.0000001; it must be from 1 to 64");
  EXPECT_EQ(text(solver->set_material(Material::uniform(65))), "p is 65; it must be from 1 to 64");
  EXPECT_EQ(text(solver->start({.tolerance = 0.1000001})),
            "tolerance is 0.1000001; it must satisfy 1e-14 <= tolerance <= 0.1");
  EXPECT_EQ(text(solver->start({.tolerance = kNan})),
            "tolerance is nan; it must satisfy 1e-14 <= tolerance <= 0.1");
}

TEST_F(DeformerTest, KeepsItsStateWhereAnInputIsRefused) {
  auto solver = deformer(shape, ends(30), Material::uniform(1.5));
  ASSERT_TRUE(solver->solve({}).ok());
  const Points before = solver->positions();
  const HandleSet handles = solver->handles();
  HandleSet bad = handles;
  (void)bad.set("more", {{10000}, Fixed{}});
  EXPECT_FALSE(solver->set_handles(bad).ok());
  EXPECT_FALSE(solver->set_handles({}).ok());
  EXPECT_FALSE(solver->set_material(Material::uniform(0)).ok());
  EXPECT_EQ(fault_of(solver->set_positions(Points::Zero(3, 3))).reason, "POSITIONS_SIZE");
  EXPECT_EQ(fault_of(solver->set_positions(Points::Constant(bar.vertices.rows(), 3, kNan))).reason,
            "POSITIONS_NOT_FINITE");
  EXPECT_EQ(solver->positions(), before);
  EXPECT_EQ(solver->handles(), handles);
  EXPECT_EQ(solver->material(), Material::uniform(1.5));
  EXPECT_EQ(solver->solve({}).value().stop_reason, StopReason::kConverged);
}

TEST_F(DeformerTest, GoesOnFromWhereItIs) {
  auto solver = deformer(shape, ends(40), Material::uniform(2));
  SolveSettings cold;
  cold.initial = InitialGuess::kLaplacian;
  const SolveSummary first = solver->solve(cold).value();
  ASSERT_TRUE(solver->set_handles(ends(41)).ok());
  const SolveSummary warm = solver->solve({}).value();
  EXPECT_EQ(warm.stop_reason, StopReason::kConverged);
  EXPECT_LT(warm.iterations, first.iterations);
  EXPECT_LT(warm.initial_energy, 1.1 * warm.energy);
}

TEST_F(DeformerTest, ADragBackToTheStartEndsAtRest) {
  for (const double p : {1.0, 1.5, 2.0, 6.0}) {
    auto solver = deformer(shape, ends(0), Material::uniform(p));
    double largest = 0;
    for (const double degrees : {10.0, 20.0, 30.0, 20.0, 10.0, 0.0}) {
      ASSERT_TRUE(solver->set_handles(ends(degrees)).ok());
      largest = std::max(largest, solver->solve({}).value().energy);
    }
    EXPECT_LT(std::pow(solver->summary().energy / largest, 1 / p), 1e-3) << p;
  }
}

TEST_F(DeformerTest, TakesHandlesAddedRemovedAndRegrouped) {
  auto solver = deformer(shape, ends(40), Material::uniform(1.5));
  ASSERT_TRUE(solver->solve({}).ok());
  HandleSet handles = solver->handles();
  ASSERT_TRUE(handles.set("middle", {slice(bar, 2, 4, 4), Fixed{}}).ok());
  ASSERT_TRUE(solver->set_handles(handles).ok());
  EXPECT_EQ(solver->solve({}).value().stop_reason, StopReason::kConverged);
  for (const std::int32_t i : slice(bar, 2, 4, 4)) {
    EXPECT_LT((solver->positions().row(i) - bar.vertices.row(i)).norm(), 1e-12);
  }
  ASSERT_TRUE(handles.remove("top"));
  ASSERT_TRUE(handles.set("bottom", {{0}, Fixed{}}).ok());
  ASSERT_TRUE(solver->set_handles(handles).ok());
  SolveSettings tight;
  tight.tolerance = 1e-9;
  ASSERT_TRUE(solver->solve(tight).ok());
  EXPECT_LT((solver->positions() - bar.vertices).cwiseAbs().maxCoeff(), 1e-3);  // nothing bends it any more
}

TEST_F(DeformerTest, AnInputEndsARunningSolve) {
  auto solver = deformer(shape, ends(40), Material::uniform(2));
  ASSERT_TRUE(solver->start({}).ok());
  EXPECT_TRUE(solver->step());
  ASSERT_TRUE(solver->set_handles(ends(20)).ok());
  EXPECT_EQ(solver->summary().stop_reason, StopReason::kCancelled);
  EXPECT_FALSE(solver->step());
}

TEST_F(DeformerTest, StartsFromTheRestMeshOrAGivenOne) {
  auto solver = deformer(shape, ends(40), Material::uniform(2));
  SolveSettings settings;
  settings.initial = InitialGuess::kRest;
  settings.max_iterations = 0;
  ASSERT_EQ(solver->solve(settings).value().stop_reason, StopReason::kIterationLimit);
  for (Eigen::Index i = 0; i < bar.vertices.rows(); ++i) {
    if (bar.vertices(i, 2) == 8) continue;
    EXPECT_LT((solver->positions().row(i) - bar.vertices.row(i)).norm(), 1e-13);
  }
  const Points given = shaken(bar.vertices, 0.1);
  ASSERT_TRUE(solver->set_positions(given).ok());
  EXPECT_EQ(solver->positions(), given);
  EXPECT_TRUE(solver->solve({}).ok());
}

TEST_F(DeformerTest, MeasuresPositionsThatWereSet) {
  HandleSet soft = ends(40);
  Handle pulled = {slice(bar, 2, 4, 4), RigidMotion{.translation = {1, 2, 0}}, Soft{3}};
  ASSERT_TRUE(soft.set("soft", pulled).ok());
  for (const HandleSet& handles : {ends(40), soft}) {
    auto solver = deformer(shape, handles, Material::uniform(1.5));
    const SolveSummary solved = solver->solve({}).value();
    auto other = deformer(shape, handles, Material::uniform(1.5));
    ASSERT_TRUE(other->set_positions(solver->positions()).ok());
    EXPECT_EQ(other->summary().energy, 0);
    other->measure();
    EXPECT_NEAR(other->summary().energy, solved.energy, 1e-9 * solved.energy);
    EXPECT_NEAR(other->summary().soft_energy, solved.soft_energy, 1e-9 * solved.energy);
    EXPECT_LT((other->cell_energies() - solver->cell_energies()).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_EQ(other->positions(), solver->positions());
    EXPECT_NEAR(other->solve({}).value().energy, solved.energy, 1e-4 * solved.energy);
  }
  auto free = Deformer::create(shape, {}).value();  // without handles
  ASSERT_TRUE(free->set_positions(2 * bar.vertices).ok());
  free->measure();
  EXPECT_GT(free->summary().energy, 0);
}

TEST_F(DeformerTest, AdmissionCountsTheCoarseLevelsOfMeshesOf5000Vertices) {
  for (const int side : {71, 99}) {
    const TriangleMesh sheet = grid(side, side);
    HandleSet handles;
    ASSERT_TRUE(handles.set("left", {slice(sheet, 0, 0, 2), Fixed{}}).ok());
    const auto turned = turn(Eigen::Vector3d::UnitY(), 60, {side / 2.0, 0, 0});
    ASSERT_TRUE(handles.set("right", {slice(sheet, 0, side - 2, side), turned}).ok());
    for (const double p : {1.0, 1.5, 6.0}) {
      std::size_t admitted = 0, most = 0;
      const auto admit = [&](std::size_t bytes) {
        admitted = bytes;
        return absl::OkStatus();
      };
      const auto solver = Deformer::create(rest_shape(sheet), {.admit = admit}).value();
      ASSERT_TRUE(solver->set_material(Material::uniform(p)).ok());
      ASSERT_TRUE(solver->set_handles(handles).ok());
      SolveSettings settings;
      settings.initial = InitialGuess::kLaplacian;
      settings.max_iterations = 200;
      ASSERT_TRUE(solver->start(settings).ok());
      while (solver->step()) most = std::max(most, solver->memory_bytes());
      EXPECT_LE(most, admitted) << sheet.vertices.rows() << " vertices, p = " << p;
      EXPECT_LT(admitted, 2 * most) << sheet.vertices.rows() << " vertices, p = " << p;
    }
  }
}

TEST_F(DeformerTest, SaysStalledWhereNoStepHelpsShortOfTheTolerance) {
  // Rounding of E, 1e-16, hides steps of less than about 1e-8; a tolerance of 1e-14 asks gradient descent for
  // 5e-14.
  auto solver = deformer(shape, ends(10), Material::uniform(2));
  SolveSettings settings;
  settings.method = Method::kLineSearch;
  settings.initial = InitialGuess::kLaplacian;
  settings.tolerance = 1e-14;
  const SolveSummary summary = solver->solve(settings).value();
  EXPECT_EQ(summary.stop_reason, StopReason::kStalled);
  EXPECT_LT(summary.energy, summary.initial_energy);
}

TEST_F(DeformerTest, KeepsTheBestStateAtANumericalBreakdown) {
  // In units of a tiny l, E at p = 64 leaves the range of a double: the paper's line search cannot begin.
  Material material = Material::uniform(64);
  material.length_unit = 1e-12;
  auto solver = deformer(shape, ends(60), material);
  SolveSettings settings;
  settings.method = Method::kLineSearch;
  settings.initial = InitialGuess::kRest;
  const SolveSummary summary = solver->solve(settings).value();
  EXPECT_EQ(summary.stop_reason, StopReason::kNumericalBreakdown);
  EXPECT_TRUE(solver->positions().allFinite());
  EXPECT_TRUE(std::isfinite(summary.energy));
}

TEST_F(DeformerTest, WorksAtTheHighestP) {
  auto solver = deformer(shape, ends(40), Material::uniform(64));
  SolveSettings settings;
  settings.initial = InitialGuess::kLaplacian;
  settings.max_iterations = 300;
  const SolveSummary summary = solver->solve(settings).value();
  EXPECT_LT(summary.energy, summary.initial_energy);
  EXPECT_TRUE(solver->positions().allFinite());
}

TEST_F(DeformerTest, DeformsDefectiveMeshesAndLeavesUnusedVerticesAlone) {
  TriangleMesh mesh = bar;
  const Eigen::Index n = mesh.vertices.rows(), m = mesh.faces.rows();
  mesh.vertices.conservativeResize(n + 1, 3);
  mesh.vertices.row(n) << 50, 50, 50;
  mesh.faces.conservativeResize(m + 3, 3);
  mesh.faces.row(m) = mesh.faces.row(0);  // a duplicate: its edges have more than two faces
  mesh.faces.row(m + 1) << mesh.faces(5, 0), mesh.faces(5, 0), mesh.faces(5, 1);   // no area
  mesh.faces.row(m + 2) << mesh.faces(0, 0), mesh.faces(0, 1), mesh.faces(40, 2);  // a fin
  auto solver = deformer(rest_shape(mesh), ends(40), Material::uniform(1.5));
  SolveSettings settings;
  settings.initial = InitialGuess::kLaplacian;
  const SolveSummary summary = solver->solve(settings).value();
  EXPECT_LT(summary.energy, summary.initial_energy);
  EXPECT_TRUE(solver->positions().allFinite());
  EXPECT_LT((solver->positions().row(n) - mesh.vertices.row(n)).norm(), 1e-12);
}

TEST_F(DeformerTest, GivesHeldAndUnusedVerticesBackBitForBit) {
  TriangleMesh mesh = bar;
  mesh.vertices.array() += 0.1;  // not a round number anywhere
  const Eigen::Index n = mesh.vertices.rows();
  mesh.vertices.conservativeResize(n + 1, 3);
  mesh.vertices.row(n) << 1e14, 1.0 / 3, -7;
  auto solver = deformer(rest_shape(mesh), ends(40), Material::uniform(1.5));
  auto alone = deformer(shape, ends(40), Material::uniform(1.5));
  SolveSettings settings;
  settings.initial = InitialGuess::kLaplacian;
  const SolveSummary summary = solver->solve(settings).value();
  EXPECT_EQ(summary.stop_reason, StopReason::kConverged);
  EXPECT_NEAR(summary.iterations, alone->solve(settings).value().iterations, 5);  // by rounding
  EXPECT_EQ(solver->positions().row(n), mesh.vertices.row(n));
  const HandleSet handles = ends(40);
  for (const auto& [name, handle] : handles.handles()) {
    const Points targets = target_positions(handle, mesh.vertices);
    for (std::size_t k = 0; k < handle.vertices.size(); ++k) {
      EXPECT_EQ(solver->positions().row(handle.vertices[k]), targets.row(k));
    }
  }
}

TEST_F(DeformerTest, HoldsTheHandlesAlsoWhereTheEnergyOverflows) {
  HandleSet handles = ends(0);
  ASSERT_TRUE(handles.set_motion("top", RigidMotion{.translation = {1e7, 0, 0}}).ok());
  auto solver = deformer(shape, handles, Material::uniform(64));
  SolveSettings settings;
  settings.method = Method::kLineSearch;
  settings.initial = InitialGuess::kLaplacian;
  settings.certify = true;
  const SolveSummary summary = solver->solve(settings).value();
  EXPECT_EQ(summary.stop_reason, StopReason::kNumericalBreakdown);
  EXPECT_EQ(summary.optimality_gap.value(), 1);
  for (const std::int32_t i : slice(bar, 2, 8, 8))
    EXPECT_EQ(solver->positions()(i, 0), bar.vertices(i, 0) + 1e7);
}

TEST_F(DeformerTest, ReportsStatisticsOfItsDistortion) {
  Field energies(40);
  for (int i = 0; i < 40; ++i) energies[i] = i;
  const DistortionStatistics statistics = distortion_statistics(energies, 10);
  EXPECT_DOUBLE_EQ(statistics.median, 19.5);
  EXPECT_DOUBLE_EQ(statistics.top_5_percent_share, (39.0 + 38.0) / 780);
  EXPECT_EQ(statistics.edges.size(), 11u);
  EXPECT_EQ(statistics.counts[9], 4);
  EXPECT_DOUBLE_EQ(statistics.edges.back(), 39);
}

TEST_F(DeformerTest, CountsItsMemory) {
  auto solver = deformer(shape, ends(40), Material::uniform(1.5));
  ASSERT_TRUE(solver->solve({}).ok());
  EXPECT_GT(solver->memory_bytes(), static_cast<std::size_t>(bar.vertices.rows()) * 300);
}

TEST_F(DeformerTest, ACertificateIsMadeAtRestInSteps) {
  auto solver = deformer(shape, ends(60), Material::uniform(1));
  ASSERT_EQ(solver->solve({}).value().optimality_gap, std::nullopt);
  const Points result = solver->positions();
  const SolveSummary before = solver->summary();
  ASSERT_TRUE(solver->start_certificate().ok());
  EXPECT_TRUE(solver->is_certifying());
  int steps = 0;
  while (solver->step()) ++steps;
  EXPECT_GT(steps, 0);
  EXPECT_FALSE(solver->is_certifying());
  EXPECT_LT(solver->summary().optimality_gap.value(), 1e-3);
  EXPECT_EQ(solver->summary().energy, before.energy);
  EXPECT_EQ(solver->summary().iterations, before.iterations);
  EXPECT_EQ(solver->positions(), result);

  SolveSettings cold{.initial = InitialGuess::kLaplacian, .certify = true};
  EXPECT_EQ(solver->solve(cold).value().optimality_gap.value(),
            deformer(shape, ends(60), Material::uniform(1))->solve(cold).value().optimality_gap.value());
}

TEST_F(DeformerTest, NewInputsAndSolvesEndACertificate) {
  auto solver = deformer(shape, ends(60), Material::uniform(1));
  const auto begin = [&] {
    ASSERT_TRUE(solver->solve({}).ok());
    ASSERT_TRUE(solver->start_certificate().ok());
    ASSERT_TRUE(solver->step());
  };
  begin();
  ASSERT_TRUE(solver->set_handles(ends(70)).ok());
  EXPECT_FALSE(solver->step());
  EXPECT_FALSE(solver->summary().optimality_gap.has_value());
  EXPECT_EQ(fault_of(solver->start_certificate()).reason, "NOT_SOLVED");
  begin();
  ASSERT_TRUE(solver->set_material(Material::uniform(1.5)).ok());
  EXPECT_FALSE(solver->step());
  ASSERT_TRUE(solver->set_material(Material::uniform(1)).ok());
  begin();
  ASSERT_TRUE(solver->start({}).ok());
  EXPECT_FALSE(solver->is_certifying());
  EXPECT_FALSE(solver->summary().optimality_gap.has_value());
}

TEST_F(DeformerTest, AStoppedCertificateEndsWithWhatItHas) {
  auto solver = deformer(shape, ends(60), Material::uniform(1));
  ASSERT_TRUE(solver->solve({}).ok());
  std::stop_source stop;
  ASSERT_TRUE(solver->start_certificate(stop.get_token()).ok());
  stop.request_stop();
  EXPECT_FALSE(solver->step());
  EXPECT_EQ(solver->summary().optimality_gap.value(), 1);  // no bound was found yet
}

// An ordinary surface, and one whose factorisation fills up.
TEST(Deformer, AsksBeforeItTakesMemory) {
  for (const TriangleMesh& mesh : {grid(60, 60, 1), glued_at_random(200)}) {
    const auto shape = rest_shape(mesh);
    std::vector<std::size_t> asked;
    DeformerOptions options{.free_components = FreeComponents::kStay, .admit = [&](std::size_t bytes) {
                              asked.push_back(bytes);
                              return absl::OkStatus();
                            }};
    auto solver = Deformer::create(shape, options).value();
    ASSERT_EQ(asked.size(), 1u);
    HandleSet handles;
    (void)handles.set("some", {{0, 1, 2}, Fixed{}});
    ASSERT_TRUE(solver->set_handles(handles).ok());
    ASSERT_TRUE(solver->solve({.method = Method::kQuasiNewton}).ok());
    const auto held = static_cast<double>(solver->memory_bytes());
    EXPECT_NEAR(static_cast<double>(asked[0]) / held, 1, 0.4) << mesh.vertices.rows() << " vertices";
    options.admit = [](std::size_t) { return absl::ResourceExhaustedError("full"); };
    EXPECT_EQ(Deformer::create(shape, options).status(), absl::ResourceExhaustedError("full"));
  }
}

/// Of a mesh whose coarse level has a sixth of its vertices, and of one with a tenth.
class DeformerOfSide : public testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(SixthAndTenth, DeformerOfSide, testing::Values(180, 260));

TEST_P(DeformerOfSide, AsksForItsCoarseLevelsToo) {
  const int side = GetParam();
  const TriangleMesh mesh = grid(side, side, 2);
  const auto shape = rest_shape(mesh);
  std::size_t asked = 0;
  const auto admit = [&](std::size_t bytes) {
    asked = bytes;
    return absl::OkStatus();
  };
  constexpr std::int32_t kNever =
      std::numeric_limits<std::int32_t>::max();  // GradedLevelTest has these levels
  auto solver = Deformer::create(shape, {.late_graded_from = kNever, .admit = admit}).value();
  const auto move_to = [&](double height) {
    HandleSet handles;
    (void)handles.set("left", {slice(mesh, 0, 0, 0), Fixed{}});
    (void)handles.set("right", {slice(mesh, 0, side, side), RigidMotion{.translation = {0, 0, height}}});
    ASSERT_TRUE(solver->set_handles(handles).ok());
    ASSERT_TRUE(solver->solve({.max_iterations = 3}).ok());
  };
  move_to(1);
  move_to(2);  // led by the coarse levels
  EXPECT_NEAR(static_cast<double>(asked) / static_cast<double>(solver->memory_bytes()), 1, 0.05);
}

}  // namespace
}  // namespace lpdeform
