#include "core/methods/quasi_newton.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <utility>
#include <variant>

#include "core/shapes/paper_poses.h"
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

/// Iterations of the first stage of a small move in a live session.
int first_stage_of_a_move(const Material& material) {
  const PaperPose pose = paper_bar(0.5);
  HandleSet moved;
  for (const auto& [name, handle] : pose.handles.handles()) {
    Handle next = handle;
    if (auto* const motion = std::get_if<RigidMotion>(&next.motion)) motion->angle_radians *= 1.02;
    (void)moved.set(name, std::move(next));
  }
  const auto live = deformer(rest_shape(pose.mesh), pose.handles, material);
  (void)live->solve({.effort = 0});
  (void)live->set_handles(moved);
  const SolveSummary summary = live->solve({.effort = 0, .keep_trace = true}).value();
  return static_cast<int>(
      std::count_if(summary.trace.begin(), summary.trace.end(),
                    [](const IterationRecord& record) { return record.stage == 0 && record.iteration > 0; }));
}

/// Near p = 1 the first stage of a live session ends where smoothing is in the way. At larger p_i it looks 20 iterations back, and beside
/// a large p_i what smoothing adds says nothing about the cells of the low ones.
TEST(QuasiNewtonStages, OfALiveSessionAreShorterNearOne) {
  const int near_one = first_stage_of_a_move(Material::uniform(1));
  EXPECT_GE(near_one, 10);
  EXPECT_LT(near_one, 20);
  EXPECT_GE(first_stage_of_a_move(Material::uniform(1.2)), 20);
  Material mixed = Material::uniform(1);
  mixed.p = Field::Ones(paper_bar(0.5).mesh.vertices.rows());
  mixed.p.tail(1).setConstant(3);
  EXPECT_GE(first_stage_of_a_move(mixed), 20);
}

}  // namespace
}  // namespace lpdeform
