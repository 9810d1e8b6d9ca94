#include "core/methods/quasi_newton.h"

#include <gtest/gtest.h>

#include <algorithm>
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

}  // namespace
}  // namespace lpdeform
