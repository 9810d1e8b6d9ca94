// The rotations of eight cells at a time, from matrices that no mesh need have, in every instruction set that this processor has.

// This file is compiled once for each instruction set, as core/energy/cell_kernel.cc.
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_AVX3_DL)
#ifdef __aarch64__
#define HWY_COMPILE_ONLY_STATIC
#endif
#define HWY_TARGET_INCLUDE "tests/core/energy/rotation_lanes_test.cc"
#include <hwy/foreach_target.h>

#include <hwy/highway.h>

#include "core/energy/rotation_lanes-inl.h"

HWY_BEFORE_NAMESPACE();
namespace lpdeform::HWY_NAMESPACE {

/// fit() of [entry][lane], as [entry][lane], and whether each lane is good.
void FitLanes(const double* from, const double* bounds, double* to, double* good) {
  const D d;
  Matrix b[kVectors], rotation[kVectors];
  V bound[kVectors];
  M is_good[kVectors];
  for (std::size_t v = 0; v < kVectors; ++v) {
    const std::size_t lane = v * hn::Lanes(d);
    for (std::size_t e = 0; e < 9; ++e) b[v].m[e / 3][e % 3] = hn::LoadU(d, from + e * kLanes + lane);
    bound[v] = hn::LoadU(d, bounds + lane);
  }
  fit(b, bound, rotation, is_good);
  for (std::size_t v = 0; v < kVectors; ++v) {
    const std::size_t lane = v * hn::Lanes(d);
    for (std::size_t e = 0; e < 9; ++e) hn::StoreU(rotation[v].m[e / 3][e % 3], d, to + e * kLanes + lane);
    hn::StoreU(hn::IfThenElseZero(is_good[v], hn::Set(d, 1.0)), d, good + lane);
  }
}

}  // namespace lpdeform::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <limits>
#include <random>

#include "core/energy/rotation_fit.h"
#include "tests/core/every_instruction_set.h"

namespace lpdeform {

HWY_EXPORT(FitLanes);

namespace {

constexpr std::size_t kLanes = CellBlocks::kLanes;

class RotationLanes : public EveryInstructionSet {
 protected:
  /// Fits all lanes to `b`, and checks those that are said to be good. Returns whether they are.
  static bool expect_right(const Eigen::Matrix3d& b, double bound) {
    double from[9 * kLanes], bounds[kLanes], to[9 * kLanes], good[kLanes];
    for (std::size_t k = 0; k < kLanes; ++k) {
      for (std::size_t e = 0; e < 9; ++e) from[e * kLanes + k] = b(e / 3, e % 3);
      bounds[k] = bound;
    }
    HWY_DYNAMIC_DISPATCH(FitLanes)(from, bounds, to, good);
    const Eigen::Matrix3d best = fit_rotation_svd(b);
    for (std::size_t k = 0; k < kLanes; ++k) {
      EXPECT_EQ(good[k], good[0]);
      if (good[k] == 0) continue;
      Eigen::Matrix3d r;
      for (std::size_t e = 0; e < 9; ++e) r(e / 3, e % 3) = to[e * kLanes + k];
      EXPECT_LT((r * r.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-13) << b;
      EXPECT_GT(r.determinant(), 0) << b;
      EXPECT_GT(r.cwiseProduct(b).sum(), best.cwiseProduct(b).sum() - 1e-13 * b.norm()) << b;
    }
    return good[0] != 0;
  }

  static double least_bound(const Eigen::Matrix3d& b) {
    return Eigen::JacobiSVD<Eigen::Matrix3d>(b).singularValues().sum();
  }
};

TEST_P(RotationLanes, AreGoodForAnyMatrixOfFullRankWithAnyBound) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int k = 0; k < 300; ++k) {
    const Eigen::Matrix3d b =
        Eigen::Matrix3d::Identity() + 0.3 * Eigen::Matrix3d::NullaryExpr([&] { return normal(random); });
    for (const double times : {1.0, 1.5, 100.0, std::numeric_limits<double>::quiet_NaN()})
      EXPECT_TRUE(expect_right(b, times * least_bound(b))) << b;
  }
}

// In single precision the squares of such null vectors underflow.
TEST_P(RotationLanes, AreRotationsBetweenTheRanks) {
  Eigen::Matrix3d b, c;
  b << 0, 1.304136287426733e-08, 0, 1, 0, 0, 0, 1.9808346847617186e-23, 0;
  c << 1.628421301232478e-08, -1.6141673194555589e-11, 0, 0, 0, 0, 0, 1, 0;
  for (const double times : {1.0, 1.2, 1.5, 2.0}) {
    expect_right(b, times * least_bound(b));
    expect_right(c, times * least_bound(c));
  }
  std::mt19937 random(2);
  const auto part = [&random] { return static_cast<double>(random() % 4096) / 4096; };
  for (int k = 0; k < 3000; ++k) {
    for (double& entry : b.reshaped())
      entry = part() < 0.5 ? 0 : std::pow(10.0, -25 * part()) - std::pow(10.0, -9 * part());
    expect_right(b, (1 + part()) * least_bound(b));
  }
}

TEST_P(RotationLanes, AreUncertainWhereThereIsNoBestRotation) {
  const Eigen::Matrix3d zero = Eigen::Matrix3d::Zero();
  EXPECT_FALSE(expect_right(zero, 0));
  EXPECT_FALSE(expect_right(Eigen::Vector3d(1, 0, 0).asDiagonal(), 1));
  EXPECT_FALSE(expect_right(-Eigen::Matrix3d::Identity(), 3));
  EXPECT_FALSE(expect_right(1e-310 * Eigen::Matrix3d::Identity(), 3e-310));
}

INSTANTIATE_TEST_SUITE_P(Targets, RotationLanes, testing::ValuesIn(instruction_sets()), by_its_name);

}  // namespace
}  // namespace lpdeform

#endif
