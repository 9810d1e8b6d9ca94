#include "core/constraints/soft_terms.h"

#include <gtest/gtest.h>

#include "core/methods/objective.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

Material material_of(double p, std::int32_t n) {
  if (p > 0) return Material::uniform(p);
  Material mixed;
  mixed.p = Field::LinSpaced(n, 1, 6);
  mixed.stiffness = Field::LinSpaced(n, 0.5, 2);
  return mixed;
}

/// A term of each size: a vertex, an edge, a face, and two rows in one.
SoftTerms some_terms(const RestShape& shape) {
  SoftTerms terms(0.7);
  const std::int32_t a = shape.faces()(5, 0), b = shape.faces()(5, 1), c = shape.faces()(5, 2);
  const Eigen::RowVector3d target(1, -2, 0.5);
  terms.add(3, {{{1, {3}, {1}}, target, 2.0}});
  terms.add(a, {{{2, {a, b}, {1, -1}}, 0.3 * target, 0.7}});
  terms.add(c, {{{3, {a, b, c}, {0.2, 0.3, 0.5}}, -target, 5.0}, {{1, {7}, {1}}, target, 1.0}});
  return terms;
}

class SoftTermsTest : public testing::TestWithParam<double> {
 protected:
  const std::shared_ptr<const RestShape> shape = rest_shape(box_surface(2, 2, 3));
  const std::int32_t n = shape->vertex_count();
  const LpNorm norm{material_of(GetParam(), n), n, 1, 0.8};
  const Points x = shaken(shape->scaled_positions(), 0.3);
};

TEST_P(SoftTermsTest, AddTheGradientOfTheirSum) {
  Objective objective(shape, Workers(1));
  objective.set_soft_terms(some_terms(*shape));
  objective.evaluate(x, norm);
  Points gradient;
  objective.gradient(gradient);
  const double h = 1e-6;
  for (Eigen::Index k = 0; k < x.size(); ++k) {
    Points left = x, right = x;
    left.data()[k] -= h;
    right.data()[k] += h;
    const double slope = (objective.evaluate(right, norm) - objective.evaluate(left, norm)) / (2 * h);
    EXPECT_NEAR(gradient.data()[k], slope, 1e-6 * gradient.cwiseAbs().maxCoeff()) << k;
  }
}

TEST_P(SoftTermsTest, AreThePowersThatTheHeaderStates) {
  SoftTerms terms = some_terms(*shape);
  const double sum = terms.evaluate(x, norm);
  double expected = 0;
  for (std::size_t k = 0; k < terms.size(); ++k) {
    const double d = std::sqrt(terms.squared_distances()[k]), l = 0.7;
    const std::int32_t a = terms.anchor(k);
    expected += norm.coefficient(a) * std::pow(l, norm.p(a)) * std::pow(d / l, std::max(norm.p(a), 2.0));
    EXPECT_NEAR(terms.coefficient(k, norm) * std::pow(d, terms.exponent(k, norm)),
                norm.coefficient(a) * std::pow(l, norm.p(a)) * std::pow(d / l, std::max(norm.p(a), 2.0)),
                1e-12 * sum);
  }
  EXPECT_NEAR(sum, expected, 1e-12 * expected);
  EXPECT_EQ(terms.sum(norm), sum);
  EXPECT_EQ(terms.reweigh(norm), sum);
  EXPECT_NEAR(terms.squared_distances()[0], 2 * (x.row(3) - Eigen::RowVector3d(1, -2, 0.5)).squaredNorm(),
              1e-12);
}

TEST_P(SoftTermsTest, GiveTheMetricTheirHessianWhereTheyAreQuadratic) {
  if (norm.highest_p() > 2) return;
  SoftTerms terms = some_terms(*shape);
  const Points there = shaken(x, 0.5);
  Points change = Points::Zero(n, 3), at_x = change, expected = change;
  terms.evaluate(there, norm);
  terms.add_gradient(change);
  terms.evaluate(x, norm);
  terms.add_gradient(at_x);
  change -= at_x;
  for (const MatrixEntry& entry : terms.matrix_entries()) {
    expected.row(entry.row) += entry.value * (there - x).row(entry.column);
    if (entry.row != entry.column) expected.row(entry.column) += entry.value * (there - x).row(entry.row);
  }
  EXPECT_LT((change - expected).norm(), 1e-12 * change.norm());
}

INSTANTIATE_TEST_SUITE_P(Norms, SoftTermsTest, testing::Values(1.0, 1.5, 2.0, 6.0, -1.0));

}  // namespace
}  // namespace lpdeform
