#include "core/certificate/certificate.h"

#include <gtest/gtest.h>

#include "core/methods/conic_step.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

/// A bar under a twist, or another pose, and all that a method works with.
class CertificateTest : public testing::Test {
 protected:
  CertificateTest() : CertificateTest(bar_twist(box_surface(4, 4, 21))) {}
  explicit CertificateTest(HandleSet pose)
      : handles(std::move(pose)),
        constraints(make_constraints(*shape, handles, FreeComponents::kError).value()),
        objective(shape, Workers(1)),
        metric(Metric::create(shape).value()) {}

  LpNorm norm(const Material& material) const {
    return LpNorm(material, shape->vertex_count(), shape->mean_edge_length(), 1.0);
  }
  Problem problem(const LpNorm& norm) {
    return {objective, metric, constraints, norm, 1e-5, 1, shape->diagonal() / shape->mean_edge_length(),
            1e-20,     1e-20,  {}};
  }
  /// Every second cell a million times as stiff.
  Material of_varying_stiffness(double p) const {
    Material material = Material::uniform(p);
    material.stiffness.resize(shape->vertex_count());
    for (std::int32_t i = 0; i < shape->vertex_count(); ++i) material.stiffness[i] = i % 2 == 0 ? 1e-3 : 1e3;
    return material;
  }
  Points solved(const Material& material, double tolerance) {
    auto solver = deformer(shape, handles, material);
    SolveSettings settings;
    settings.initial = InitialGuess::kLaplacian;
    settings.tolerance = tolerance;
    (void)solver->solve(settings);
    return (solver->positions().rowwise() - shape->centre()) / shape->mean_edge_length();
  }

  const TriangleMesh bar = box_surface(4, 4, 21);
  const std::shared_ptr<const RestShape> shape = rest_shape(bar);
  const HandleSet handles;
  const Constraints constraints;
  Objective objective;
  Metric metric;
};

Material mixed(std::int32_t n) {
  Material material;
  material.p.resize(n);
  for (std::int32_t i = 0; i < n; ++i) material.p[i] = i % 2 == 0 ? 1.5 : 3.0;
  return material;
}

TEST_F(CertificateTest, IsTightAtTheMinimum) {
  for (const double p : {1.0, 1.2, 1.5, 2.0, 6.0, -1.0}) {
    const Material material = p > 0 ? Material::uniform(p) : mixed(shape->vertex_count());
    const LpNorm norm = this->norm(material);
    const Points x = solved(material, 1e-9);
    objective.evaluate(x, norm);
    EXPECT_LT(relative_gap(problem(norm), x), p == 1 ? 1e-4 : 1e-6) << "p = " << p;
  }
}

TEST_F(CertificateTest, IsTightWherePIsBarelyAboveOne) {
  for (const double p : {1 + 1e-9, 1 + 1e-6, 1 + 1e-3}) {
    const Material material = Material::uniform(p);
    const LpNorm norm = this->norm(material);
    const Points x = solved(material, 1e-9);
    objective.evaluate(x, norm);
    EXPECT_LT(relative_gap(problem(norm), x), 1e-3) << "p = 1 + " << p - 1;
  }
}

/// Soft terms have at least p = 2, and cells that are stretched past an edge have far larger forces at a large p.
TEST_F(CertificateTest, ClaimsNothingWherePIsBarelyAboveOneBesideLargerExponents) {
  const auto gap = [&](const Material& material) {
    HandleSet soft = handles;
    EXPECT_TRUE(
        soft.set("middle", {slice(bar, 2, 10, 10), RigidMotion{.translation = {0, 6, 0}}, Soft{0.05}}).ok());
    const Constraints held = make_constraints(*shape, soft, FreeComponents::kError).value();
    auto solver = deformer(shape, soft, material);
    SolveSettings settings;
    settings.initial = InitialGuess::kLaplacian;
    settings.max_iterations = 5;
    settings.certify = true;
    settings.effort = 0;
    return solver->solve(settings).value().optimality_gap.value();
  };
  const double at_one = gap(Material::uniform(1));
  EXPECT_GT(at_one, 0.01);
  for (const double p : {1 + 1e-9, 1 + 1e-6, 1 + 1e-4})
    EXPECT_NEAR(gap(Material::uniform(p)), at_one, 0.2 * at_one) << "p = 1 + " << p - 1;
  for (const double high : {2.0, 6.0, 64.0}) {
    Material material = Material::uniform(1.001);
    material.p.resize(shape->vertex_count());
    for (std::int32_t i = 0; i < shape->vertex_count(); ++i)
      material.p[i] = bar.vertices(i, 2) > 17 ? high : 1.001;
    EXPECT_GT(gap(material), 1e-3) << high;
  }
}

TEST_F(CertificateTest, IsTightWithStiffnessThatVariesByMillions) {
  for (const double p : {1.0, 2.0, 6.0}) {
    const Material material = of_varying_stiffness(p);
    const LpNorm norm = this->norm(material);
    const Points x = solved(material, 1e-10);
    objective.evaluate(x, norm);
    EXPECT_LT(relative_gap(problem(norm), x), 1e-3) << "p = " << p;
  }
}

/// Bent, so that at p = 1 most cells are at rest and carry forces that their residuals do not show.
class BentCertificateTest : public CertificateTest {
 protected:
  BentCertificateTest() : CertificateTest(bar_bend(box_surface(4, 4, 21))) {}
};

TEST_F(BentCertificateTest, WithoutTimeIsLooserAndStillABound) {
  const LpNorm norm = this->norm(Material::uniform(1));
  const Points x = solved(Material::uniform(1), 1e-6);
  objective.evaluate(x, norm);
  const double polished = relative_gap(problem(norm), x);
  objective.evaluate(x, norm);
  const double unpolished = relative_gap(problem(norm), x, {.good_enough = 0, .max_seconds = 0});
  EXPECT_GT(unpolished, polished) << polished;
  EXPECT_LT(unpolished, 1);
}

TEST_F(CertificateTest, IsLooseAwayFromIt) {
  for (const double p : {1.0, 1.5, 2.0, 6.0}) {
    const LpNorm norm = this->norm(Material::uniform(p));
    const Points x = constraints.targets;  // the rest mesh with its middle turned
    objective.evaluate(x, norm);
    EXPECT_GT(relative_gap(problem(norm), x), 0.01) << "p = " << p;
  }
}

TEST_F(CertificateTest, NeverClaimsMoreThanTheConvexStepAllows) {
  // At p = 2 the convex step has a closed solution: its value may not be below the bound, from anywhere.
  const LpNorm norm = this->norm(Material::uniform(2));
  const Points x = shaken(constraints.targets, 0.2);
  Points start = x;
  for (Eigen::Index i = 0; i < start.rows(); ++i) {
    if (constraints.is_held[i]) start.row(i) = constraints.targets.row(i);
  }
  const double value = objective.evaluate(start, norm);
  const double gap = relative_gap(problem(norm), start);
  objective.evaluate(start, norm);
  Points gradient;
  objective.gradient(gradient);
  restrict_to_free(constraints, gradient);
  ASSERT_TRUE(metric.factor(objective.cells().cell_weights(), constraints.is_held, {}, Workers(1)));
  metric.solve(gradient, gradient, Workers(1));
  const double optimum = objective.evaluate_held(start - gradient, norm);
  EXPECT_NEAR((value - optimum) / value, gap, 1e-9);  // and for p = 2 it is that value
}

TEST_F(CertificateTest, BoundsWhatTheConeProgramFinds) {
  const LpNorm norm = this->norm(Material::uniform(1));
  const Points x = solved(Material::uniform(1), 1e-3);
  const double energy = objective.evaluate(x, norm);
  const std::vector<Eigen::Matrix3d> rotations = objective.cells().rotations();
  const double bound = energy * (1 - relative_gap(problem(norm), x));
  ConicStep cone(problem(norm), rotations, x);
  while (cone.relative_gap() > 1e-8 && cone.iterate()) {
  }
  ASSERT_LE(cone.relative_gap(), 1e-6);
  EXPECT_LE(bound, cone.primal() * (1 + 1e-12));
  EXPECT_LE(cone.lower_bound(), energy);
}

TEST_F(CertificateTest, IsZeroAtRest) {
  const LpNorm norm = this->norm(Material::uniform(1));
  objective.evaluate(shape->scaled_positions(), norm);
  EXPECT_EQ(relative_gap(problem(norm), shape->scaled_positions()), 0);
}

}  // namespace
}  // namespace lpdeform
