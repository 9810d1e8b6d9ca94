// A late graded level that cannot be made, or that leads nowhere, costs a solve nothing but time.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/constraints/constraints.h"
#include "core/multiresolution/multiresolution.h"
#include "tests/core/multiresolution/keeping_solver.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

constexpr double kP = 1.5;
constexpr double kMostRise = 1.2;  // of the sum of E_i^p in one step

class RefusingSolver : public KeepingSolver {
 public:
  using KeepingSolver::KeepingSolver;
  absl::Status start_prepared(const SolveSettings& /*settings*/, std::stop_token /*stop*/) override {
    return absl::InternalError("it does not start");
  }
};

class GradedFailuresTest : public testing::Test {
 protected:
  using Make = std::function<std::unique_ptr<LevelSolver>(const RestShape& level)>;

  GradedFailuresTest() {
    (void)handles.set("bottom", {slice(mesh, 2, 0, 10), Fixed{}});
    (void)handles.set("top", {slice(mesh, 2, 134, 144), turn({1, 0.2, 0}, 80, {2, 18, 72})});
  }

  /// E^(1/p) at the end of a minimisation whose late graded level has a solver by `make`; without one if `make` is null. It begins at the
  /// rest shape, the answer of a coarse level that makes no steps.
  double solve(const Make& make) {
    const double unit = shape->mean_edge_length();
    const Material material = Material::uniform(kP);
    const Constraints constraints = make_constraints(*shape, handles, FreeComponents::kError).value();
    Objective objective(shape, Workers(1));
    Metric metric = Metric::create(shape).value();
    EXPECT_TRUE(
        metric.factor(std::vector<double>(shape->vertex_count(), 1.0), constraints.is_held, {}, Workers(1)));
    const LpNorm norm(material, shape->vertex_count(), unit, 1);
    Points guess = constraints.targets;
    for (Eigen::Index i = 0; i < guess.rows(); ++i) {
      if (!constraints.is_held[i]) guess(i, i % 3) += std::sin(static_cast<double>(i));
    }
    objective.evaluate(guess, norm);
    const Problem problem{objective, metric, constraints, norm, 1e-6, 1, shape->diagonal() / unit,
                          1e-20,     1e-20,  {}};
    const auto coarse = CoarseLevel::create(
        *shape, CoarseLevel::coarsened(*shape),
        [](std::shared_ptr<const RestShape> level) { return std::make_unique<KeepingSolver>(*level); });
    EXPECT_TRUE(coarse->take_over({*shape, handles, constraints, material, 1}).ok());
    const auto count_and_make = [&](std::shared_ptr<const RestShape> level) {
      ++made;
      return make(*level);
    };
    std::optional<Grading> grading;
    if (make) grading.emplace(handles, material, count_and_make, false, true);
    Multiresolution method(problem, guess, *coarse, 0, std::move(grading));
    made = 0;
    StepResult before, now;
    for (int step = 0; step < 5000 && now.outcome == Outcome::kProgress; ++step) {
      before = std::exchange(now, method.step());
      if (step > 0) {
        EXPECT_GE(now.stage, before.stage) << "step " << step;
      }
      if (step > 0 && now.stage == before.stage) {
        EXPECT_LE(now.objective, before.objective * (1 + 1e-12)) << "step " << step;
      }
      if (step > 1) {  // from one stage to the next, too
        EXPECT_LE(*now.true_sum, kMostRise * *before.true_sum) << "step " << step;
      }
    }
    EXPECT_EQ(now.outcome, Outcome::kConverged);
    EXPECT_TRUE(method.x().allFinite());
    for (Eigen::Index i = 0; i < guess.rows(); ++i) {
      if (constraints.is_held[i]) {
        EXPECT_EQ(method.x().row(i), constraints.targets.row(i));
      }
    }
    return std::pow(objective.sum(norm), 1 / kP);
  }

  const TriangleMesh mesh = box_surface(4, 36, 144);
  const std::shared_ptr<const RestShape> shape = rest_shape(mesh);
  HandleSet handles;
  int made = 0;  // solvers of graded levels, by the last solve()
};

TEST_F(GradedFailuresTest, ASolveEndsAsLowAsWithoutTheLevel) {
  const double alone = solve(nullptr);
  const auto expect_as_low = [&](const char* what, const Make& make) {
    SCOPED_TRACE(what);
    const double with = solve(make);
    EXPECT_EQ(made, 1);
    EXPECT_LT(with, 1.005 * alone);
  };
  expect_as_low("no solver", [](const RestShape&) { return nullptr; });
  expect_as_low("it does not start",
                [](const RestShape& level) { return std::make_unique<RefusingSolver>(level); });
  expect_as_low("no step", [](const RestShape& level) { return std::make_unique<KeepingSolver>(level); });
  expect_as_low("a worse state", [](const RestShape& level) {
    return std::make_unique<KeepingSolver>(level, nullptr, 3, 1.0);
  });
  expect_as_low("no numbers", [](const RestShape& level) {
    return std::make_unique<KeepingSolver>(level, nullptr, 3, std::nan(""));
  });
}

}  // namespace
}  // namespace lpdeform
