#include "core/methods/kinks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/constraints/constraints.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

/// A sheet at p = 6 that is bent smoothly, with a few vertices pushed off it.
class KinksTest : public testing::Test {
 protected:
  static constexpr int kSide = 60;  // 3,721 vertices

  explicit KinksTest(double p = 6) : norm(Material::uniform(p), shape->vertex_count(), 1, 1) {
    for (Eigen::Index i = 0; i < smooth.rows(); ++i) {
      const double angle = 0.5 * smooth(i, 0) / kSide;
      smooth(i, 2) += smooth(i, 0) * std::sin(angle);
      smooth(i, 0) *= std::cos(angle);
    }
    kinked = smooth;
    for (const int i : {800, 1500, 2222}) kinked(i, 2) += 0.5;
  }

  Problem problem(int threads = 1) {
    objective.emplace(shape, Workers(threads));
    const double infinity = std::numeric_limits<double>::infinity();
    return {*objective, metric, constraints, norm, 1e-4, 1, shape->diagonal(), -infinity, -infinity, {}};
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
    EXPECT_EQ(constraints.is_held[i], 0);
  }
  EXPECT_LT(moved, 1000);  // the rest stays
}

TEST_F(KinksTest, ASmoothSurfaceStays) {
  Problem made = problem();
  const double before = objective->evaluate(smooth, norm);
  Points x = smooth;
  EXPECT_FALSE(ease_kinks(made, x));
  EXPECT_EQ(x, smooth);
  EXPECT_EQ(objective->sum(norm), before);
}

/// A spike that held vertices make.
TEST_F(KinksTest, WhatDoesNotLowerTheEnergyIsTakenBack) {
  for (Eigen::Index i = 0; i < kinked.rows(); ++i) constraints.is_held[i] = 1;
  Problem made = problem();
  const double before = objective->evaluate(kinked, norm);
  Points x = kinked;
  EXPECT_FALSE(ease_kinks(made, x));
  EXPECT_EQ(x, kinked);
  EXPECT_EQ(objective->sum(norm), before);
}

TEST_F(KinksTest, GivesTheSameBitsOnAnyNumberOfThreads) {
  Points one = kinked, two = kinked;
  Problem made = problem(1);
  objective->evaluate(one, norm);
  EXPECT_TRUE(ease_kinks(made, one));
  Problem other = problem(2);
  objective->evaluate(two, norm);
  EXPECT_TRUE(ease_kinks(other, two));
  EXPECT_EQ(one, two);
}

class KinksAtTwoTest : public KinksTest {
 protected:
  KinksAtTwoTest() : KinksTest(2) {}
};

TEST_F(KinksAtTwoTest, AtTwoNothingIsEased) {
  Problem made = problem();
  objective->evaluate(kinked, norm);
  Points x = kinked;
  EXPECT_FALSE(ease_kinks(made, x));
  EXPECT_EQ(x, kinked);
}

}  // namespace
}  // namespace lpdeform
