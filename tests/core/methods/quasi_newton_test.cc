#include "core/methods/quasi_newton.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

/// The least number of records of a stage of smoothing, of a bar that is bent at p = 1. -1 if there is none before the last.
int shortest_stage(double tolerance) {
  constexpr int kOnTheWay = 6;  // stages, from p = 2 towards 1
  const TriangleMesh mesh = box_surface(4, 4, 24);
  HandleSet handles;
  (void)handles.set("bottom", {slice(mesh, 2, 0, 0), Fixed{}});
  (void)handles.set("top", {slice(mesh, 2, 24, 24), turn(Eigen::Vector3d::UnitX(), 80, {2, 2, 12})});
  SolveSettings settings;
  settings.method = Method::kQuasiNewton;
  settings.initial = InitialGuess::kLaplacian;
  settings.tolerance = tolerance;
  settings.effort = 0;
  settings.keep_trace = true;
  const auto solver = deformer(rest_shape(mesh), handles, Material::uniform(1));
  const SolveSummary summary = solver->solve(settings).value();
  std::map<int, int> records;
  for (const IterationRecord& record : summary.trace) ++records[record.stage];
  int least = -1;
  for (const auto& [stage, count] : records) {
    if (stage >= kOnTheWay && stage != records.rbegin()->first)
      least = least < 0 ? count : std::min(least, count);
  }
  return least;
}

/// A stage looks 20 iterations back, or fewer in a rough solve, as on coarse levels.
TEST(QuasiNewtonStages, OfSmoothingAreShorterInARoughSolve) {
  EXPECT_GE(shortest_stage(1e-3), 20);
  const int rough = shortest_stage(2e-3);
  EXPECT_GE(rough, 5);
  EXPECT_LT(rough, 20);
}

/// Stiff cells among cells of next to no stiffness. Single precision does not carry the metric of these weights.
TEST(QuasiNewtonMetric, TakesNoMemoryForDoublePrecision) {
  const TriangleMesh mesh = box_surface(8, 8, 26);
  const auto shape = rest_shape(mesh);
  HandleSet handles;
  (void)handles.set("bottom", {slice(mesh, 2, 0, 0), Fixed{}});
  (void)handles.set("top", {slice(mesh, 2, 26, 26), turn(Eigen::Vector3d::UnitX(), 40, {4, 4, 13})});
  Material loose = Material::uniform(2);
  loose.stiffness = Field::Constant(shape->vertex_count(), Material::kLowestStiffness);
  for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
    const auto at = mesh.vertices.row(i);
    if (at[0] == 4 && at[1] == 0 && at[2] > 0 && at[2] < 26 && std::lround(at[2]) % 4 == 0)
      loose.stiffness[i] = Material::kHighestStiffness;
  }
  SolveSettings settings;
  settings.method = Method::kQuasiNewton;
  const auto solver = deformer(shape, handles, loose), even = deformer(shape, handles, Material::uniform(2));
  for (int solve = 0; solve < 2; ++solve) {  // a cold and a warm one
    EXPECT_EQ(solver->solve(settings).value().stop_reason, StopReason::kConverged);
    EXPECT_TRUE(solver->positions().allFinite());
    (void)even->solve(settings);
    EXPECT_LT(solver->memory_bytes(),
              1.05 * static_cast<double>(even->memory_bytes() + shape->vertex_count() * sizeof(double)));
    (void)handles.set("top", {slice(mesh, 2, 26, 26), turn(Eigen::Vector3d::UnitX(), 45, {4, 4, 13})});
    ASSERT_TRUE(solver->set_handles(handles).ok());
    ASSERT_TRUE(even->set_handles(handles).ok());
  }
}

/// The metric of a guess at p = 2 serves the solve, too.
TEST(QuasiNewtonMetric, IsNotFactoredAgainWhereItServes) {
  const TriangleMesh mesh = box_surface(4, 4, 24);
  HandleSet handles;
  (void)handles.set("bottom", {slice(mesh, 2, 0, 0), Fixed{}});
  (void)handles.set("top", {slice(mesh, 2, 24, 24), turn(Eigen::Vector3d::UnitX(), 80, {2, 2, 12})});
  SolveSettings settings;
  settings.method = Method::kQuasiNewton;
  settings.initial = InitialGuess::kLaplacian;
  const auto solver = deformer(rest_shape(mesh), handles, Material::uniform(2));
  EXPECT_EQ(solver->solve(settings).value().factorisations, 1);
  EXPECT_EQ(solver->solve(settings).value().factorisations, 0);
}

}  // namespace
}  // namespace lpdeform
