// Every kind of handle through the whole solver: soft, points inside faces, orientation, locks, footprints.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/base/fault.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

static_assert(std::variant_size_v<Hold> == 5, "each kind of hold is among the kinds under test");
enum class Kind { kSoft, kPoint, kSoftPoint, kOrientation, kAxisLock, kPlaneLock };

/// A bar whose lower end is held; the kind under test is at its upper end, sent up and over.
class HandleKinds : public testing::TestWithParam<std::tuple<Kind, double>> {
 protected:
  static Kind kind() { return std::get<0>(GetParam()); }
  static double p() { return std::get<1>(GetParam()); }

  std::vector<SurfacePoint> face_points() const {
    std::vector<SurfacePoint> points;
    for (std::int32_t f = 0; f < bar.faces.rows() && points.size() < 3; ++f) {
      bool is_at_top = true;
      for (int c = 0; c < 3; ++c) is_at_top = is_at_top && bar.vertices(bar.faces(f, c), 2) == 10;
      if (is_at_top) points.push_back({f, {0.2, 0.3, 0.5}});
    }
    return points;
  }

  Handle handle(Kind kind) const {
    const RigidMotion motion = turn({1, 0, 0}, 40, {1, 1, 5}, {0.3, -0.2, 0.4});
    const std::vector<std::int32_t> top = slice(bar, 2, 10, 10);
    switch (kind) {
      case Kind::kSoft:
        return {top, motion, Soft{3}};
      case Kind::kPoint:
        return {{}, motion, Exactly{}, face_points()};
      case Kind::kSoftPoint:
        return {{}, motion, Soft{30}, face_points()};
      case Kind::kOrientation:
        return {top, motion, Orientation{}};
      case Kind::kAxisLock:
        return {top, motion, AxisLock{{0.3, 1, -0.5}}};
      case Kind::kPlaneLock:
        return {top, motion, PlaneLock{{0, 0.6, 0.8}}};
    }
    return {};
  }

  HandleSet handles() const {
    HandleSet set;
    EXPECT_TRUE(set.set("bottom", {slice(bar, 2, 0, 0), Fixed{}}).ok());
    EXPECT_TRUE(set.set("top", handle(kind())).ok());
    return set;
  }

  static SolveSettings cold(double tolerance = 1e-5) {
    SolveSettings settings;
    settings.initial = InitialGuess::kLaplacian;
    settings.tolerance = tolerance;
    return settings;
  }

  const TriangleMesh bar = box_surface(2, 2, 10);
  const std::shared_ptr<const RestShape> shape = rest_shape(bar);
};

TEST_P(HandleKinds, ConvergeOnAMonotoneTrace) {
  auto solver = deformer(shape, handles(), Material::uniform(p()));
  SolveSettings settings = cold();
  settings.keep_trace = true;
  const SolveSummary summary = solver->solve(settings).value();
  EXPECT_EQ(summary.stop_reason, StopReason::kConverged);
  EXPECT_LT(summary.energy, summary.initial_energy);
  for (std::size_t k = 2; k < summary.trace.size(); ++k) {
    const IterationRecord &before = summary.trace[k - 1], &now = summary.trace[k];
    if (now.stage == before.stage) {
      EXPECT_LE(now.objective, before.objective * (1 + 1e-13)) << k;
    }
  }
}

TEST_P(HandleKinds, GiveTheSameBitsOnAnyNumberOfThreads) {
  auto one = deformer(shape, handles(), Material::uniform(p()), {.threads = 1, .vertices_a_thread = 1});
  auto two = deformer(shape, handles(), Material::uniform(p()), {.threads = 2, .vertices_a_thread = 1});
  ASSERT_TRUE(one->solve(cold()).ok());
  ASSERT_TRUE(two->solve(cold()).ok());
  EXPECT_EQ(one->positions(), two->positions());
}

TEST_P(HandleKinds, TurnMoveAndScaleWithEverything) {
  auto here = deformer(shape, handles(), Material::uniform(p()));
  const double energy = here->solve(cold(1e-9)).value().energy;
  const double scale = 250;
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).matrix();
  const Eigen::RowVector3d offset(30, -70, 10);
  const auto there_of = [&](const Points& points) {
    return Points((scale * points * rotation.transpose()).rowwise() + offset);
  };
  TriangleMesh moved{there_of(bar.vertices), bar.faces};
  HandleSet set;
  const HandleSet originals = handles();
  for (const auto& [name, original] : originals.handles()) {
    Handle copy = original;
    if (auto* rigid = std::get_if<RigidMotion>(&copy.motion)) {
      rigid->axis = rotation * rigid->axis;
      rigid->center = scale * rotation * rigid->center + offset.transpose();
      rigid->translation = scale * rotation * rigid->translation;
    }
    if (auto* lock = std::get_if<AxisLock>(&copy.hold)) lock->axis = 7 * rotation * lock->axis;
    if (auto* lock = std::get_if<PlaneLock>(&copy.hold)) lock->normal = 7 * rotation * lock->normal;
    ASSERT_TRUE(set.set(name, copy).ok());
  }
  auto there = deformer(rest_shape(moved), set, Material::uniform(p()));
  const double scaled = there->solve(cold(1e-9)).value().energy;
  EXPECT_NEAR(std::pow(scaled, 1 / p()) / scale, std::pow(energy, 1 / p()), 1e-4 * std::pow(energy, 1 / p()));
}

TEST_P(HandleKinds, GoOnLiveToWhereAColdSolveEnds) {
  HandleSet moving = handles();
  auto live = deformer(shape, moving, Material::uniform(p()));
  ASSERT_TRUE(live->solve(cold()).ok());
  for (const double degrees : {42.0, 44.0, 46.0}) {
    ASSERT_TRUE(moving.set_motion("top", turn({1, 0, 0}, degrees, {1, 1, 5}, {0.3, -0.2, 0.4})).ok());
    ASSERT_TRUE(live->set_handles(moving).ok());
    SolveSettings warm;
    warm.tolerance = 1e-8;
    ASSERT_TRUE(live->solve(warm).ok());
  }
  auto fresh = deformer(shape, moving, Material::uniform(p()));
  const double wanted = fresh->solve(cold(1e-8)).value().energy;
  EXPECT_LT(std::pow(live->summary().energy / wanted, 1 / p()), 1.01);
}

TEST_P(HandleKinds, LeaveTheSurfaceAtRestWhereNothingMoves) {
  HandleSet still = handles();
  ASSERT_TRUE(still.set_motion("top", Fixed{}).ok());
  auto solver = deformer(shape, still, Material::uniform(p()));
  ASSERT_TRUE(solver->solve(cold()).ok());
  EXPECT_LT((solver->positions() - bar.vertices).cwiseAbs().maxCoeff(), 1e-9);
}

INSTANTIATE_TEST_SUITE_P(KindsAndNorms, HandleKinds,
                         testing::Combine(testing::Values(Kind::kSoft, Kind::kPoint, Kind::kSoftPoint,
                                                          Kind::kOrientation, Kind::kAxisLock,
                                                          Kind::kPlaneLock),
                                          testing::Values(1.0, 1.5, 2.0, 6.0)));

}  // namespace
}  // namespace lpdeform
