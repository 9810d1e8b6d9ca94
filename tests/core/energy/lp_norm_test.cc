#include "core/energy/lp_norm.h"

#include <gtest/gtest.h>

#include <limits>

namespace lpdeform {
namespace {

TEST(LpNorm, WeighsByTheDerivativeOfItsTerm) {
  for (const double p : {1.0, 1.2, 1.5, 2.0, 3.0, 6.0, 64.0}) {
    const LpNorm norm = LpNorm(Material::uniform(p), 5, 0.1, 2.0).smoothed(p < 2 ? 1e-3 : 0);
    for (const double e2 : {0.01, 1.0, 3.0}) {
      const double step = 1e-6 * e2;
      const double difference = (norm.term(0, e2 + step).value - norm.term(0, e2 - step).value) / (2 * step);
      EXPECT_NEAR(norm.term(0, e2).weight, difference, 1e-6 * std::abs(difference) + 1e-300);
    }
  }
}

TEST(LpNorm, GivesACellAtZeroNoWeightBelowTwo) {
  EXPECT_EQ(LpNorm(Material::uniform(1), 1, 1, 1).term(0, 0).weight, 0);
  EXPECT_EQ(LpNorm(Material::uniform(1), 1, 1, 1).term(0, 0).value, 0);
  EXPECT_EQ(LpNorm(Material::uniform(2), 1, 1, 1).term(0, 0).weight, 1);
}

TEST(LpNorm, StaysInRangeAtTheHighestP) {
  const LpNorm norm(Material::uniform(64), 1, 1e-6, 1e7);
  const LpNorm::Term term = norm.term(0, 1e14);
  EXPECT_NEAR(term.value, 1, 1e-10);
  EXPECT_TRUE(std::isfinite(term.weight));
  EXPECT_EQ(LpNorm(Material::uniform(64), 1, 1e6, 1e7).true_energy(1), std::numeric_limits<double>::max());
}

TEST(LpNorm, MovesEveryPTowardsTwo) {
  Material material;
  material.p = Eigen::Vector3d(1, 2, 6);
  const LpNorm half = LpNorm(material, 3, 1, 1).nearer_two(0.5);
  EXPECT_DOUBLE_EQ(half.p(0), 1.5);
  EXPECT_DOUBLE_EQ(half.p(1), 2);
  EXPECT_DOUBLE_EQ(half.p(2), 4);
}

TEST(LpNorm, SmoothedIsNeverBelowTheTrueOne) {
  const LpNorm norm(Material::uniform(1), 1, 1, 1);
  for (const double e2 : {0.0, 1e-6, 1.0})
    EXPECT_GE(norm.smoothed(1e-4).term(0, e2).value, norm.term(0, e2).value);
}

}  // namespace
}  // namespace lpdeform
