#include "core/linalg/single_cholesky.h"

#include <gtest/gtest.h>

#include <limits>
#include <utility>

#include "core/base/fault.h"
#include "tests/core/linalg/matrices.h"

namespace lpdeform {
namespace {

SingleCholesky analysed(const LowerMatrix& matrix) {
  return SingleCholesky(analyse_supernodes(matrix).value());
}

TEST(SingleCholesky, FactorsNarrowAndWideSupernodes) {
  for (const auto& [size, width] : {std::pair{1, 1}, {60, 1}, {200, 4}, {150, 149}, {400, 100}}) {
    const Eigen::MatrixXd a = banded(size, width);
    const LowerMatrix matrix = lower(a);
    SingleCholesky single = analysed(matrix);
    ASSERT_TRUE(single.factor(RowsOf(matrix), Workers(1)));
    const Points expected = Points::Random(size, 3);
    Points x;
    single.result().solve(Points(a * expected), x, Workers(1));
    // The matrix is diagonally dominant: its condition is below 10.
    EXPECT_LT((x - expected).cwiseAbs().maxCoeff(), 1e-5) << size << " " << width;
  }
}

TEST(SingleCholesky, GivesTheSameBitsOnAnyNumberOfThreadsAndTheRightOnes) {
  for (const auto& [side, shortcuts] : {std::pair{60, 0}, {150, 0}, {220, 300}, {260, 700}}) {
    const LowerMatrix matrix = square_laplacian(side, shortcuts);
    SparseCholesky cholesky(matrix);
    ASSERT_TRUE(cholesky.factor(matrix));
    const Points b = Points::Random(side * side, 3);
    Points expected, one, several;
    cholesky.solve(b, expected);
    SingleCholesky single = analysed(matrix);
    ASSERT_TRUE(single.factor(RowsOf(matrix), Workers(1)));
    single.result().solve(b, one, Workers(1));
    EXPECT_LT((one - expected).cwiseAbs().maxCoeff(), 1e-5);
    for (const int threads : {2, 4}) {
      ASSERT_TRUE(single.factor(RowsOf(matrix), Workers(threads)));
      single.result().solve(b, several, Workers(threads));
      EXPECT_EQ(several, one);
    }
  }
}

TEST(SingleCholesky, FactorsMatricesOfSeveralComponents) {
  for (const int components : {2, 25}) {
    const LowerMatrix one = square_laplacian(components == 2 ? 180 : 50);
    LowerMatrix all;
    all.columns.push_back(0);
    for (int k = 0; k < components; ++k) {
      const std::int32_t before = k * one.size();
      const auto entries = static_cast<std::int32_t>(all.rows.size());
      for (const std::int32_t row : one.rows) all.rows.push_back(before + row);
      all.values.insert(all.values.end(), one.values.begin(), one.values.end());
      for (std::int32_t c = 1; c <= one.size(); ++c) all.columns.push_back(entries + one.columns[c]);
    }
    SparseCholesky cholesky(all);
    ASSERT_TRUE(cholesky.factor(all));
    const Points b = Points::Random(all.size(), 3);
    Points expected, alone, both;
    cholesky.solve(b, expected);
    SingleCholesky single = analysed(all);
    ASSERT_TRUE(single.factor(RowsOf(all), Workers(1)));
    single.result().solve(b, alone, Workers(1));
    EXPECT_LT((alone - expected).cwiseAbs().maxCoeff(), 1e-5);
    ASSERT_TRUE(single.factor(RowsOf(all), Workers(2)));
    single.result().solve(b, both, Workers(2));
    EXPECT_EQ(both, alone);
  }
}

TEST(SingleCholesky, FactorsOtherValuesOfThePattern) {
  LowerMatrix matrix = square_laplacian(40);
  SingleCholesky single = analysed(matrix);
  Points b = Points::Random(1600, 3), first, second;
  ASSERT_TRUE(single.factor(RowsOf(matrix), Workers(2)));
  single.result().solve(b, first, Workers(1));
  for (double& value : matrix.values) value *= 4;
  ASSERT_TRUE(single.factor(RowsOf(matrix), Workers(2)));
  single.result().solve(b, second, Workers(1));
  EXPECT_LT((first - 4 * second).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(SingleCholesky, FactorsAgainAfterItsValuesHaveBeenFreed) {
  const LowerMatrix matrix = square_laplacian(40);
  SingleCholesky single = analysed(matrix);
  Points b = Points::Random(1600, 3), before, after;
  ASSERT_TRUE(single.factor(RowsOf(matrix), Workers(2)));
  single.result().solve(b, before, Workers(1));
  const std::size_t bytes = single.memory_bytes();
  EXPECT_EQ(single.freed_bytes(), 0u);
  single.free_values();
  EXPECT_LT(single.memory_bytes(), bytes - matrix.rows.size() * sizeof(float));
  const std::size_t freed = single.freed_bytes(), left = single.memory_bytes();
  ASSERT_TRUE(single.factor(RowsOf(matrix), Workers(2)));
  single.result().solve(b, after, Workers(1));
  EXPECT_EQ(before, after);
  EXPECT_LE(single.memory_bytes(), bytes);
  EXPECT_EQ(single.memory_bytes(), left + freed);
  EXPECT_EQ(single.freed_bytes(), 0u);
}

TEST(SingleCholesky, RefusesWhatSinglePrecisionDoesNotCarry) {
  for (const double wrong :
       {-1.0, 0.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e60}) {
    LowerMatrix matrix = square_laplacian(100);
    SingleCholesky single = analysed(matrix);
    for (const std::int32_t j : {0, 5050, 9999}) {
      const double right = std::exchange(matrix.values[matrix.columns[j]], wrong);
      EXPECT_FALSE(single.factor(RowsOf(matrix), Workers(2))) << wrong << " at " << j;
      matrix.values[matrix.columns[j]] = right;
    }
    EXPECT_TRUE(single.factor(RowsOf(matrix), Workers(2)));
  }
  // Definite, but by less than the digits of single precision.
  Eigen::MatrixXd a = Eigen::MatrixXd::Ones(2, 2);
  a(0, 0) += 1e-8;
  const LowerMatrix matrix = lower(a);
  EXPECT_FALSE(analysed(matrix).factor(RowsOf(matrix), Workers(1)));
}

/// Stars that nothing holds: each has a pivot of zero, because a constant on one of them costs nothing.
LowerMatrix loose_stars(int count, int leaves) {
  LowerMatrix result;
  for (int star = 0; star < count; ++star) {
    const std::int32_t centre = (star + 1) * (leaves + 1) - 1;
    for (std::int32_t leaf = centre - leaves; leaf <= centre; ++leaf) {
      result.columns.push_back(static_cast<std::int32_t>(result.rows.size()));
      result.rows.push_back(leaf);
      result.values.push_back(leaf == centre ? leaves : 1);
      if (leaf == centre) continue;
      result.rows.push_back(centre);
      result.values.push_back(-1);
    }
  }
  result.columns.push_back(static_cast<std::int32_t>(result.rows.size()));
  return result;
}

TEST(SingleCholesky, RaisesAFewPivotsIfThatIsWanted) {
  constexpr int kStars = 20, kLeaves = 4000, kSize = kLeaves + 1;
  const LowerMatrix matrix = loose_stars(kStars, kLeaves);
  SingleCholesky single = analysed(matrix);
  EXPECT_FALSE(single.factor(RowsOf(matrix), Workers(2)));
  Points b = Points::Random(matrix.size(), 3), x, of_one_thread;
  for (int star = 0; star < kStars; ++star) {
    const Eigen::RowVector3d mean = b.middleRows(kSize * star, kSize).colwise().mean();
    b.middleRows(kSize * star, kSize).rowwise() -= mean;
  }
  for (const int threads : {1, 2, 4}) {
    EXPECT_FALSE(single.factor(RowsOf(matrix), Workers(threads), kStars - 1)) << threads;
    ASSERT_TRUE(single.factor(RowsOf(matrix), Workers(threads), kStars)) << threads;
    single.result().solve(b, x, Workers(threads));
    if (threads == 1) of_one_thread = x;
    EXPECT_EQ(x, of_one_thread) << threads;
  }
  for (std::int32_t leaf = 0; leaf < matrix.size(); ++leaf) {
    const std::int32_t centre = (leaf / kSize + 1) * kSize - 1;
    if (leaf == centre) continue;
    const Eigen::RowVector3d residual = x.row(leaf) - x.row(centre) - b.row(leaf);
    ASSERT_LT(residual.norm(), 1e-5 * (1 + x.row(centre).norm())) << leaf;
  }
}

TEST(SupernodePattern, KnowsHowManyMultiplicationsAFactorisationTakes) {
  const SupernodePattern pattern = analyse_supernodes(square_laplacian(30)).value();
  double sum = 0;
  for (std::size_t k = 0; k + 1 < pattern.first_columns.size(); ++k) {
    const auto below = static_cast<double>(pattern.first_rows[k + 1] - pattern.first_rows[k]);
    for (std::int32_t j = pattern.first_columns[k]; j < pattern.first_columns[k + 1]; ++j) {
      const double entries = below + pattern.first_columns[k + 1] - j;
      sum += entries * entries;
    }
  }
  EXPECT_NEAR(operation_count(pattern), sum, 1e-9 * sum);
}

TEST(SupernodePattern, IsRefusedWhereTheFactorIsTooLarge) {
  const LowerMatrix matrix = square_laplacian(30);
  const std::size_t entries = entry_count(analyse_supernodes(matrix).value());
  EXPECT_TRUE(analyse_supernodes(matrix, entries).ok());
  const absl::Status refused = analyse_supernodes(matrix, entries - 1).status();
  EXPECT_EQ(refused.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(fault_of(refused).reason, "FACTOR_TOO_LARGE");
}

TEST(SupernodePattern, LetsTheDoubleFactorisationUseItsOrder) {
  const LowerMatrix matrix = square_laplacian(30);
  const auto pattern = analyse_supernodes(matrix).value();
  SparseCholesky own(matrix), given(matrix, pattern.new_to_old);
  ASSERT_TRUE(own.factor(matrix));
  ASSERT_TRUE(given.factor(matrix));
  Points b = Points::Random(900, 3), x, y;
  own.solve(b, x);
  given.solve(b, y);
  EXPECT_LT((x - y).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace
}  // namespace lpdeform
