#include "core/constraints/metric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "core/base/fault.h"
#include "tests/core/poses.h"
#include "tests/support/glued_shape.h"

namespace lpdeform {
namespace {

class MetricTest : public testing::Test {
 protected:
  MetricTest()
      : shape(rest_shape(box_surface(2, 2, 3))),
        metric(Metric::create(shape).value()),
        is_held(shape->vertex_count(), false) {
    is_held[0] = is_held[7] = is_held[20] = true;
    for (std::int32_t i = 0; i < shape->vertex_count(); ++i) cell_weights.push_back(1 + i % 3);
  }

  /// M u by its definition.
  Points apply(const Points& u) const {
    Points result = Points::Zero(u.rows(), 3);
    for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
      for (std::int32_t k = shape->offsets()[i]; k < shape->offsets()[i + 1]; ++k) {
        const std::int32_t j = shape->neighbours()[k];
        result.row(i) +=
            2 * (cell_weights[i] + cell_weights[j]) * shape->weights()[k] * (u.row(i) - u.row(j));
      }
    }
    return result;
  }

  void clear_held(Points& u) const {
    for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
      if (is_held[i]) u.row(i).setZero();
    }
  }

  std::shared_ptr<const RestShape> shape;
  Metric metric;
  std::vector<char> is_held;
  std::vector<double> cell_weights;
};

TEST_F(MetricTest, InvertsTheReweightedLaplacian) {
  ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1)));
  Points u = Points::Random(shape->vertex_count(), 3);
  for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
    if (is_held[i]) u.row(i).setZero();
  }
  Points b = apply(u), x;
  for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
    if (is_held[i]) b.row(i).setZero();
  }
  metric.solve(b, x, Workers(1));
  EXPECT_LT((x - u).norm(), 1e-12);
}

TEST_F(MetricTest, InvertsItWithEntriesAdded) {
  const std::int32_t a = shape->faces()(9, 0), b = shape->faces()(9, 1);
  const std::vector<MatrixEntry> entries = {{a, a, 3.0}, {std::max(a, b), std::min(a, b), -1.5}, {b, b, 2.0}};
  ASSERT_FALSE(is_held[a] || is_held[b]);
  ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1)));
  ASSERT_TRUE(metric.factor(cell_weights, is_held, entries, Workers(1)));
  Points u = Points::Random(shape->vertex_count(), 3);
  clear_held(u);
  Points v = apply(u), x;
  v.row(a) += 3.0 * u.row(a) - 1.5 * u.row(b);
  v.row(b) += 2.0 * u.row(b) - 1.5 * u.row(a);
  clear_held(v);
  metric.solve(v, x, Workers(1));
  EXPECT_LT((x - u).norm(), 1e-12);
}

TEST_F(MetricTest, PreconditionsLikeSolveAlsoAfterAnotherFactorAndAfterAdoptingWeights) {
  Points b = Points::Random(shape->vertex_count(), 3), exact, x;
  for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
    if (is_held[i]) b.row(i).setZero();
  }
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1)));
    metric.solve(b, exact, Workers(1));
    metric.precondition(b, x, Workers(1));
    EXPECT_LT((x - exact).norm(), 1e-5 * exact.norm());
    cell_weights[5] += 10;
  }
  cell_weights[5] -= 10;
  for (double& weight : cell_weights) weight *= 3;
  metric.adopt(cell_weights);
  metric.precondition(b, x, Workers(1));
  EXPECT_LT((3 * x - exact).norm(), 1e-5 * exact.norm());
  for (const double useless : {0.0, std::nan(""), HUGE_VAL}) {
    metric.adopt(std::vector<double>(cell_weights.size(), useless));
    metric.precondition(b, x, Workers(1));
    EXPECT_LT((3 * x - exact).norm(), 1e-5 * exact.norm());
  }
}

TEST_F(MetricTest, ExtendsDisplacementsHarmonically) {
  ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1)));
  Points u = Points::Zero(shape->vertex_count(), 3);
  u.row(0) << 1, 2, 3;
  u.row(7) << -1, 0, 1;
  metric.extend(is_held, u, Workers(1));
  EXPECT_EQ(u.row(20), Eigen::RowVector3d(0, 0, 0));
  EXPECT_EQ(u.row(0), Eigen::RowVector3d(1, 2, 3));
  const Points residual = apply(u);
  for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
    EXPECT_TRUE(is_held[i] || residual.row(i).norm() < 1e-5) << i;
  }
}

TEST_F(MetricTest, KnowsWhichHandlesItWasFactoredFor) {
  EXPECT_FALSE(metric.is_factored_for(is_held));
  ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1)));
  EXPECT_TRUE(metric.is_factored_for(is_held));
  is_held[1] = true;
  EXPECT_FALSE(metric.is_factored_for(is_held));
}

TEST_F(MetricTest, SolvesWhereSinglePrecisionDoesNotCarryTheMatrix) {
  // Held at one end alone, and between the ends cells of next to no weight.
  std::fill(is_held.begin(), is_held.end(), false);
  for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
    const double z = shape->scaled_positions()(i, 2);
    is_held[i] = z == shape->scaled_positions().col(2).minCoeff();
    cell_weights[i] = z == shape->scaled_positions().col(2).maxCoeff() ? 1 : 1e-8;
  }
  ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1)));
  Points b = Points::Random(shape->vertex_count(), 3), x, y;
  clear_held(b);
  metric.solve(b, x, Workers(1));
  metric.precondition(b, y, Workers(1));
  EXPECT_LT((x - y).norm(), 1e-5 * x.norm());
  x = apply(x);
  clear_held(x);
  EXPECT_LT((x - b).norm(), 1e-6 * b.norm());
}

/// A long box, held at its bottom. Single cells weigh much, and those around them next to nothing: a vertex and its neighbours hang together, and
/// hardly on anything else.
TEST(MetricOfLooseCells, RaisesAFewPivotsButNotManyIfThatIsWanted) {
  for (const auto& [count, is_rough] : {std::pair{8, true}, {20, false}}) {
    const auto shape = rest_shape(box_surface(2, 2, 4 * count + 2));
    std::vector<char> is_held(shape->vertex_count());
    std::vector<double> cell_weights(shape->vertex_count());
    for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
      const auto at = shape->positions().row(i);
      is_held[i] = at[2] == 0;
      cell_weights[i] = at[0] == 1 && at[1] == 0 && at[2] > 0 && std::lround(at[2]) % 4 == 0 ? 1 : 1e-8;
    }
    Metric exact = Metric::create(shape).value(), rough = Metric::create(shape).value();
    rough.raise_few_pivots();
    ASSERT_TRUE(exact.factor(cell_weights, is_held, {}, Workers(1)));
    ASSERT_TRUE(rough.factor(cell_weights, is_held, {}, Workers(1)));
    EXPECT_EQ(exact.memory_bytes() > 1.5 * static_cast<double>(rough.memory_bytes()), is_rough) << count;

    Points b = Points::Random(shape->vertex_count(), 3), x, y;
    for (std::int32_t i = 0; i < shape->vertex_count(); ++i) {
      if (is_held[i]) b.row(i).setZero();
    }
    rough.precondition(b, x, Workers(1));
    EXPECT_TRUE(x.allFinite());
    EXPECT_GT(x.cwiseProduct(b).sum(), 0);  // the factor is that of a positive definite matrix
    exact.solve(b, x, Workers(1));
    rough.solve(b, y, Workers(1));
    EXPECT_LT((x - y).norm(), 1e-6 * x.norm()) << count;
  }
}

TEST_F(MetricTest, GivesTheDoubleFactorBackWhenItIsNotWanted) {
  ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1)));
  const std::size_t before = metric.memory_bytes();
  ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1), Metric::Precision::kDouble));
  EXPECT_GT(metric.memory_bytes(), before);
  Points b = Points::Random(shape->vertex_count(), 3), exact, refined, x;
  clear_held(b);
  metric.solve(b, exact, Workers(1));
  metric.precondition(b, x, Workers(1));
  EXPECT_LT((x - exact).norm(), 1e-5 * exact.norm());
  ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1)));
  EXPECT_EQ(metric.memory_bytes(), before);
  metric.solve(b, refined, Workers(1));
  EXPECT_LT((refined - exact).norm(), 1e-11 * exact.norm());
}

TEST_F(MetricTest, FactorsAgainAfterItWasReleased) {
  for (const auto precision : {Metric::Precision::kSingle, Metric::Precision::kDouble}) {
    ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1), precision));
    Points b = Points::Random(shape->vertex_count(), 3), before, after;
    clear_held(b);
    metric.solve(b, before, Workers(1));
    EXPECT_EQ(metric.released_bytes(), 0u);
    const std::size_t bytes = metric.memory_bytes();
    metric.release();
    EXPECT_LT(metric.memory_bytes(), bytes - shape->neighbours().size() / 2 * sizeof(float));
    EXPECT_FALSE(metric.is_factored_for(is_held));
    EXPECT_GT(metric.released_bytes(), 0u);
    EXPECT_GT(metric.cell_weight(0), 0);
    const auto version = metric.version();
    ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1), precision));
    EXPECT_NE(metric.version(), version);
    EXPECT_TRUE(metric.is_factored_for(is_held));
    if (precision == Metric::Precision::kSingle) {
      EXPECT_EQ(metric.released_bytes(), 0u);
    }
    metric.solve(b, after, Workers(1));
    EXPECT_EQ(before, after);
  }
}

TEST_F(MetricTest, HoldsTheMatrixBesideASingleFactorOnlyAfterASolve) {
  ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1)));
  const std::size_t before = metric.memory_bytes();
  Points b = Points::Random(shape->vertex_count(), 3), x;
  clear_held(b);
  metric.solve(b, x, Workers(1));
  EXPECT_GE(metric.memory_bytes(), before + shape->vertex_count() * sizeof(double));
  cell_weights[0] *= 2;
  ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1)));
  EXPECT_EQ(metric.memory_bytes(), before);
}

TEST_F(MetricTest, GivesNoNumberForWhatIsNone) {
  ASSERT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1)));
  for (const std::int32_t i : {1, 5, shape->vertex_count() - 1}) {
    Points b = Points::Ones(shape->vertex_count(), 3), x;
    b(i, 1) = std::nan("");
    metric.precondition(b, x, Workers(1));
    EXPECT_TRUE(x.array().isNaN().all()) << i;
  }
}

TEST_F(MetricTest, FailsWithoutUsableWeights) {
  EXPECT_FALSE(metric.factor(std::vector<double>(shape->vertex_count(), 0.0), is_held, {}, Workers(1)));
  EXPECT_FALSE(
      metric.factor(std::vector<double>(shape->vertex_count(), std::nan("")), is_held, {}, Workers(1)));
}

TEST(MetricOfFaceSoup, IsRefusedWhereAFactorisationTakesTooLong) {
  const auto shape = RestShape::create(glued_at_random(6000));
  ASSERT_TRUE(shape.ok());
  std::size_t asked = 0;
  const auto refused = Metric::create(*shape, [&](std::size_t bytes) {
    asked = bytes;
    return absl::OkStatus();
  });
  const Fault fault = fault_of(refused.status());
  EXPECT_EQ(fault.reason, "FACTOR_TOO_LARGE");
  EXPECT_EQ(fault.limit, "multiplications <= 5e+11");
  EXPECT_EQ(asked, 0u);  // no memory is asked for
}

TEST_F(MetricTest, StaysPositiveDefiniteWhereCellsHaveNoWeight) {
  for (std::size_t i = 0; i < cell_weights.size(); i += 2) cell_weights[i] = 0;
  EXPECT_TRUE(metric.factor(cell_weights, is_held, {}, Workers(1)));
}

}  // namespace
}  // namespace lpdeform
