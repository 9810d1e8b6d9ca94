#include "core/methods/lbfgs_memory.h"

#include <gtest/gtest.h>

#include <vector>

namespace lpdeform {
namespace {

constexpr Eigen::Index kCount = 5001;  // vertices: some chunks, none of them whole
constexpr double kSingle = 1e-5;       // pairs are kept in single precision

/// A quadratic f = sum_k h_k x_k^2 / 2 and a diagonal metric m_k that is not its Hessian.
class LbfgsMemoryTest : public testing::TestWithParam<int> {
 protected:
  LbfgsMemoryTest() {
    for (Eigen::Index k = 0; k < 3 * kCount; ++k) {
      hessian_.data()[k] = 1 + 0.5 * std::sin(0.37 * static_cast<double>(k));
      metric_.data()[k] = 2 + 0.9 * std::cos(0.11 * static_cast<double>(k));
      x_.data()[k] = std::sin(1.7 * static_cast<double>(k)) + 0.1;
    }
  }

  double direction(double length) {
    g_before_.swap(g_);
    g_ = hessian_.cwiseProduct(x_);
    h_ = g_.cwiseQuotient(metric_).cast<float>();
    SinglePoints given = h_;
    return memory_.direction(g_, g_before_, given, length, d_);
  }

  Points h() const { return h_.cast<double>(); }

  /// Makes a step and keeps its pair for the dense formula.
  void walk(double length) {
    steps_.push_back(length * d_);
    changes_.push_back(hessian_.cwiseProduct(steps_.back()));
    x_ += steps_.back();
  }

  /// H v by the two-loop recursion (Nocedal & Wright, algorithm 7.4) over the last `count` pairs.
  Points two_loop(Points v, std::size_t count) const {
    const auto dot = [](const Points& a, const Points& b) { return a.cwiseProduct(b).sum(); };
    const std::size_t first = steps_.size() - count;
    std::vector<double> alpha(steps_.size());
    for (std::size_t i = steps_.size(); i-- > first;) {
      alpha[i] = dot(steps_[i], v) / dot(steps_[i], changes_[i]);
      v -= alpha[i] * changes_[i];
    }
    const Points &s = steps_.back(), &y = changes_.back();
    const double gamma = std::clamp(dot(s, y) / dot(y, y.cwiseQuotient(metric_)), 0.05, 4.0);
    v = (gamma * v).cwiseQuotient(metric_);
    for (std::size_t i = first; i < steps_.size(); ++i) {
      v += (alpha[i] - dot(changes_[i], v) / dot(steps_[i], changes_[i])) * steps_[i];
    }
    return v;
  }

  Points hessian_{kCount, 3}, metric_{kCount, 3}, x_{kCount, 3}, g_, g_before_, d_;
  SinglePoints h_;
  std::vector<Points> steps_, changes_;
  LbfgsMemory memory_{Workers(GetParam()), 3};
};

TEST_P(LbfgsMemoryTest, BeginsWithTheMetric) {
  const double slope = direction(0);
  EXPECT_EQ(d_, -h());
  EXPECT_NEAR(slope, -g_.cwiseProduct(h()).sum(), 1e-9 * std::abs(slope));
}

TEST_P(LbfgsMemoryTest, IsTheTwoLoopRecursionOverTheLastPairs) {
  double slope = direction(0);
  for (std::size_t step = 1; step <= 6; ++step) {
    const double length = step == 2 ? 0.5 : 0.9;
    walk(length);
    slope = direction(length);
    const Points expected = -two_loop(g_, std::min<std::size_t>(step, 3));
    EXPECT_LT((d_ - expected).norm(), kSingle * expected.norm()) << step;
    EXPECT_NEAR(slope, g_.cwiseProduct(expected).sum(), kSingle * g_.norm() * expected.norm()) << step;
  }
}

TEST_P(LbfgsMemoryTest, LeavesOutAStepWithoutCurvature) {
  direction(0);
  hessian_.setZero();
  walk(1);
  direction(1);
  EXPECT_EQ(d_, -h());
}

TEST_P(LbfgsMemoryTest, DropsTheOldestPairBeforeItKnowsTheNewOne) {
  direction(0);
  for (int step = 0; step < 3; ++step) {
    walk(0.9);
    direction(0.9);
  }
  memory_.direction(g_, g_, h_, 0.9, d_);  // no curvature
  const Points expected = -two_loop(g_, 2);
  EXPECT_LT((d_ - expected).norm(), kSingle * expected.norm());
}

TEST_P(LbfgsMemoryTest, ForgetsWhenCleared) {
  direction(0);
  walk(0.9);
  direction(0.9);
  memory_.clear();
  direction(0);
  EXPECT_LT((d_ + h()).norm(), 0.9 * h().norm());  // scaled by what was learnt, in the metric's direction
  EXPECT_NEAR(d_.cwiseProduct(h()).sum(), -d_.norm() * h().norm(), 1e-12 * d_.norm() * h().norm());
}

TEST_P(LbfgsMemoryTest, KeepsTheLastStepInAnotherMetric) {
  direction(0);
  walk(0.9);
  direction(0.9);
  walk(0.8);
  memory_.clear();
  metric_ *= 3;
  SinglePoints before = g_.cwiseQuotient(metric_).cast<float>();
  memory_.set_before(before);
  direction(0.8);
  const Points expected = -two_loop(g_, 1);
  EXPECT_LT((d_ - expected).norm(), kSingle * expected.norm());
}

TEST(LbfgsMemory, GivesTheSameBitsOnAnyNumberOfThreads) {
  std::vector<Points> results;
  for (const int threads : {1, 2, 4}) {
    LbfgsMemory memory(Workers(threads), 2);
    const Points g0 = Points::Constant(kCount, 3, 1.25);
    Points d;
    SinglePoints h = g0.cast<float>();
    memory.direction(g0, g0, h, 0, d);
    Points g1 = g0 / 3;
    for (Eigen::Index k = 0; k < g1.size(); ++k) g1.data()[k] += 1e-3 * std::sin(static_cast<double>(k));
    h = g1.cast<float>();
    memory.direction(g1, g0, h, 1, d);
    results.push_back(d);
  }
  EXPECT_EQ(results[0], results[1]);
  EXPECT_EQ(results[0], results[2]);
}

INSTANTIATE_TEST_SUITE_P(Threads, LbfgsMemoryTest, testing::Values(1, 2));

}  // namespace
}  // namespace lpdeform
