#include "core/solve/random_waves.h"

#include <gtest/gtest.h>

namespace lpdeform {
namespace {

constexpr double kDiagonal = 100;

/// Vertices along the x axis, one unit apart.
Points line() {
  Points result = Points::Zero(101, 3);
  for (Eigen::Index i = 0; i < result.rows(); ++i) result(i, 0) = static_cast<double>(i);
  return result;
}

double length_at(const RandomWaves& waves, double x) {
  return waves.at(Eigen::RowVector3d(x, 0, 0)).norm();
}

TEST(RandomWaves, WithoutARadiusTheyAreEverywhereAndDifferByNumber) {
  const std::vector<char> none(101, 0);
  const RandomWaves first(0, line(), kDiagonal, {.share = 0.2, .radius = 0}, none);
  const RandomWaves again(0, line(), kDiagonal, {.share = 0.2, .radius = 0}, none);
  const RandomWaves second(1, line(), kDiagonal, {.share = 0.2, .radius = 0}, none);
  for (const double x : {0.0, 37.0, 100.0}) {
    EXPECT_GT(length_at(first, x), 0.01);
    EXPECT_EQ(length_at(first, x), length_at(again, x));
    EXPECT_NE(length_at(first, x), length_at(second, x));
  }
}

TEST(RandomWaves, WithARadiusOnlyTheSurroundingsOfAFreeVertexAreDisplaced) {
  const int free = 20;
  std::vector<char> is_held(101, 1);
  is_held[free] = 0;
  for (int number = 0; number < 20; ++number) {
    const RandomWaves waves(number, line(), kDiagonal, {.share = 0.2, .radius = 0.05}, is_held);
    double sum = 0, far = 0;
    for (int i = 0; i <= 100; ++i) {
      sum += length_at(waves, i);
      if (i > free + 30) far += length_at(waves, i);  // six radii
    }
    EXPECT_GT(sum, 0);
    EXPECT_LT(far, 1e-6 * sum) << number;
  }
}

TEST(RandomWaves, ALargerRadiusReachesFarther) {
  const std::vector<char> none(101, 0);
  const RandomWaves narrow(3, line(), kDiagonal, {.share = 0.2, .radius = 0.02}, none);
  const RandomWaves wide(3, line(), kDiagonal, {.share = 0.2, .radius = 0.2}, none);
  const RandomWaves everywhere(3, line(), kDiagonal, {.share = 0.2, .radius = 0}, none);
  double narrow_sum = 0, wide_sum = 0, whole = 0;
  for (int i = 0; i <= 100; ++i) {
    EXPECT_LE(length_at(narrow, i), length_at(wide, i));
    EXPECT_LE(length_at(wide, i), length_at(everywhere, i));
    narrow_sum += length_at(narrow, i);
    wide_sum += length_at(wide, i);
    whole += length_at(everywhere, i);
  }
  EXPECT_GT(narrow_sum, 0);
  EXPECT_LT(narrow_sum, 0.25 * wide_sum);
  EXPECT_LT(wide_sum, 0.9 * whole);
}

}  // namespace
}  // namespace lpdeform
