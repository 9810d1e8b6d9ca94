#include "core/methods/kinks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <stop_token>
#include <vector>

#include "core/constraints/constraints.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

/// A sheet at p = 6 that is bent smoothly, with a few vertices pushed off it.
class KinksTest : public testing::Test {
 protected:
  static constexpr int kSide = 160;  // 25,921 vertices

  explicit KinksTest(double p = 6) : norm(Material::uniform(p), shape->vertex_count(), 1, 1) {
    for (Eigen::Index i = 0; i < smooth.rows(); ++i) {
      const double angle = 0.5 * smooth(i, 0) / kSide;
      smooth(i, 2) += smooth(i, 0) * std::sin(angle);
      smooth(i, 0) *= std::cos(angle);
    }
    kinked = smooth;
    for (const double x : {1, 50, 100}) kinked(at(x, 80), 2) += 0.5;
  }

  Problem problem(int threads = 1) {
    objective.emplace(shape, Workers(threads));
    const double infinity = std::numeric_limits<double>::infinity();
    return {*objective, metric, constraints, norm, 1e-4, 1, shape->diagonal(), -infinity, -infinity, stop};
  }
  /// Nothing is to be eased at `state`.
  void expect_stays(const Points& state) {
    Problem made = problem();
    const double before = objective->evaluate(state, norm);
    Points x = state;
    EXPECT_FALSE(ease_kinks(made, x));
    EXPECT_EQ(x, state);
    EXPECT_EQ(objective->sum(norm), before);
  }
  /// The vertex at a place of the flat sheet.
  std::int32_t at(double x, double y) const {
    Eigen::Index found = 0;
    const Eigen::RowVector2d place(x, y);
    (shape->positions().leftCols(2).rowwise() - place).rowwise().squaredNorm().minCoeff(&found);
    return static_cast<std::int32_t>(found);
  }
  double energy(const Points& x) { return Objective(shape, Workers(1)).evaluate(x, norm); }

  std::shared_ptr<const RestShape> shape = rest_shape(grid(kSide, kSide, 1));
  HandleSet handles = [this] {
    HandleSet result;
    (void)result.set("left", {slice({shape->positions(), shape->faces()}, 0, 0, 0), Fixed{}});
    return result;
  }();
  Constraints constraints = make_constraints(*shape, handles, FreeComponents::kError).value();
  Metric metric = Metric::create(shape).value();
  std::optional<Objective> objective;
  LpNorm norm;
  std::stop_token stop;
  Points smooth = shape->scaled_positions(), kinked;
};

TEST_F(KinksTest, AFewVerticesOffTheSurfaceGoBack) {
  Problem made = problem();
  objective->evaluate(kinked, norm);
  Points x = kinked;
  EXPECT_TRUE(ease_kinks(made, x));
  const double least = energy(smooth);
  EXPECT_GT(energy(kinked), 1000 * least);
  EXPECT_LT(energy(x), 3 * least);
  EXPECT_EQ(objective->sum(norm), energy(x));
  int moved = 0;
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    if (x.row(i) == kinked.row(i)) continue;
    ++moved;
    EXPECT_EQ(constraints.is_held[i], 0);  // one kink is beside held vertices
  }
  EXPECT_LT(moved, 3000);  // the rest stays
}

TEST_F(KinksTest, ASmoothSurfaceStays) {
  expect_stays(smooth);
}

TEST_F(KinksTest, AnOverflownEnergyIsLeftAlone) {
  expect_stays(1e80 * kinked);
}

TEST_F(KinksTest, WhoStopsBeforeTheFirstSweepGetsTheStateBack) {
  std::stop_source source;
  source.request_stop();
  stop = source.get_token();
  expect_stays(kinked);
}

TEST_F(KinksTest, WhereKinksAreScatteredFewerRingsAreEased) {
  for (int k = 0; k < 150; ++k) kinked(at(5 + 10 * (k % 15), 5 + 15 * (k / 15)), 2) += 0.2;
  Problem made = problem();
  objective->evaluate(kinked, norm);
  Points x = kinked;
  EXPECT_TRUE(ease_kinks(made, x));
  const auto moved = (x - kinked).rowwise().any().count();
  EXPECT_GT(moved, 500);
  EXPECT_LT(static_cast<double>(moved), 0.15 * static_cast<double>(x.rows()));
}

TEST_F(KinksTest, HeldVerticesStay) {
  for (Eigen::Index i = 0; i < kinked.rows(); ++i) constraints.is_held[i] = 1;
  expect_stays(kinked);
}

/// A vertex is held off the sheet, in the minimum at p = 3. Sweeps go towards that at p = 2, where the energy at p = 6 is higher.
TEST_F(KinksTest, WhatDoesNotLowerTheEnergyIsTakenBack) {
  const std::int32_t spike = at(80, 80);
  (void)handles.set("spike", {{spike}, turn(Eigen::Vector3d::UnitZ(), 0, {0, 0, 0}, {0, 0, 2})});
  constraints = make_constraints(*shape, handles, FreeComponents::kError).value();
  const auto solver = deformer(shape, handles, Material::uniform(3));
  (void)solver->solve({.effort = 0});
  Points spiked = (solver->positions().rowwise() - shape->centre()) / shape->mean_edge_length();
  for (const std::int32_t i : constraints.exact.vertices) spiked.row(i) = constraints.targets.row(i);
  Objective spiked_only(shape, Workers(1));
  spiked_only.evaluate(spiked, norm);
  const std::vector<double>& squares = spiked_only.cells().squared_energies();
  std::vector<double> terms(squares.size());
  std::ranges::transform(squares, terms.begin(), [](double e2) { return e2 * e2 * e2; });
  std::ranges::sort(terms, std::greater<>());
  const double few = std::accumulate(terms.begin(), terms.begin() + 25, 0.0);
  ASSERT_GT(few, 0.5 * std::accumulate(terms.begin(), terms.end(), 0.0));  // as a kink has it
  expect_stays(spiked);
}

TEST_F(KinksTest, GivesTheSameBitsOnAnyNumberOfThreads) {
  for (int k = 1; k < 16; ++k) kinked(at(10 * k, 40), 2) += 0.2;  // so that the patch has several chunks
  Points one = kinked, two = kinked;
  Problem made = problem(1);
  objective->evaluate(one, norm);
  EXPECT_TRUE(ease_kinks(made, one));
  Problem other = problem(2);
  objective->evaluate(two, norm);
  EXPECT_TRUE(ease_kinks(other, two));
  EXPECT_EQ(one, two);
  EXPECT_NE(one.row(at(80, 40)), kinked.row(at(80, 40)));
}

class KinksAtTwoTest : public KinksTest {
 protected:
  KinksAtTwoTest() : KinksTest(2) {}

  Points relaxed(const Points& from, int sweeps, int threads = 1) {
    const Problem made = problem(threads);
    objective->set_soft_terms(constraints.soft);
    objective->evaluate(from, norm);
    Points x = from;
    relax(made, norm, sweeps, x);
    return x;
  }
};

TEST_F(KinksAtTwoTest, SweepsTakeKinksAwayAndLeaveTheRest) {
  const Points x = relaxed(kinked, 3);
  const double least = energy(smooth);
  EXPECT_GT(energy(kinked), 1.5 * least);
  EXPECT_LT(energy(x) - least, 0.2 * (energy(kinked) - least));
  EXPECT_LT((relaxed(smooth, 3) - smooth).cwiseAbs().maxCoeff(), 0.02);
  for (const std::int32_t i : constraints.exact.vertices) EXPECT_EQ(x.row(i), kinked.row(i));
}

TEST_F(KinksAtTwoTest, SweepsGiveTheSameBitsOnAnyNumberOfThreads) {
  EXPECT_EQ(relaxed(kinked, 3, 1), relaxed(kinked, 3, 2));
}

TEST_F(KinksAtTwoTest, AStopDoesNotEndTheSweeps) {
  const Points expected = relaxed(kinked, 3);
  std::stop_source source;
  source.request_stop();
  stop = source.get_token();
  EXPECT_EQ(relaxed(kinked, 3), expected);
}

/// Beside a point's reaction the rest of the gradient is zero.
TEST_F(KinksAtTwoTest, SweepsLeaveAMinimumWithAPointAlone) {
  Handle point;
  const std::int32_t corner = at(80, 0);  // on the border, where the diagonal of the metric is smaller
  std::int32_t face = 0;
  while ((shape->faces().row(face).array() != corner).all()) ++face;
  point.points = {{face, {0.4, 0.3, 0.3}}};
  point.motion = turn(Eigen::Vector3d::UnitZ(), 0, {0, 0, 0}, {3, 0, 0});
  ASSERT_TRUE(handles.set("point", point).ok());
  constraints = make_constraints(*shape, handles, FreeComponents::kError).value();
  const auto solver = deformer(shape, handles, Material::uniform(2));
  (void)solver->solve({.tolerance = 1e-4, .effort = 0});
  const Points least = (solver->positions().rowwise() - shape->centre()) / shape->mean_edge_length();
  EXPECT_LT((relaxed(least, 3) - least).cwiseAbs().maxCoeff(), 1e-3);
}

/// Handles that pull a thousand times as hard as the surface.
TEST_F(KinksAtTwoTest, SweepsAllowForSoftTerms) {
  Handle vertices{{at(80, 80), at(81, 80)}, turn(Eigen::Vector3d::UnitZ(), 0, {0, 0, 0}, {0, 0, 0.1})};
  Handle point;  // has entries off the diagonal
  point.points = {{static_cast<std::int32_t>(shape->faces().rows() / 3), {0.2, 0.3, 0.5}}};
  point.motion = vertices.motion;
  vertices.hold = point.hold = Soft{1000};
  for (const Handle& soft : {vertices, point}) {
    ASSERT_TRUE(handles.set("soft", soft).ok());
    constraints = make_constraints(*shape, handles, FreeComponents::kError).value();
    const Points x = relaxed(smooth, 20);
    EXPECT_LT(objective->evaluate(x, norm), 0.9 * objective->evaluate(smooth, norm));
  }
}

TEST_F(KinksAtTwoTest, AtTwoNothingIsEased) {
  expect_stays(kinked);
}

}  // namespace
}  // namespace lpdeform
