#include "server/runtime/load_gauge.h"

#include <gtest/gtest.h>

namespace lpdeform {
namespace {

using std::chrono::milliseconds;

class LoadGaugeTest : public testing::Test {
 protected:
  /// So many waits of this length, one after the other every 10 ms.
  void wait(int times, milliseconds length) {
    for (int k = 0; k < times; ++k) gauge_.waited(length, now_ += milliseconds(10));
  }
  bool is_overloaded() { return gauge_.is_overloaded(now_); }

  LoadGauge gauge_;
  LoadGauge::TimePoint now_ = LoadGauge::TimePoint(std::chrono::hours(1));
};

TEST_F(LoadGaugeTest, OneLongWaitIsNoOverloadManyAre) {
  wait(100, milliseconds(1));
  wait(1, milliseconds(800));
  EXPECT_FALSE(is_overloaded());
  wait(30, milliseconds(300));
  EXPECT_TRUE(is_overloaded());
}

TEST_F(LoadGaugeTest, DoesNotFlicker) {
  wait(50, milliseconds(200));
  ASSERT_TRUE(is_overloaded());
  wait(150, milliseconds(0));  // one and a half seconds
  EXPECT_TRUE(is_overloaded());
  wait(100, milliseconds(0));
  EXPECT_FALSE(is_overloaded());
  // Between the two bounds it stays as it is.
  wait(1000, milliseconds(60));
  EXPECT_FALSE(is_overloaded());
  wait(50, milliseconds(200));
  ASSERT_TRUE(is_overloaded());
  wait(1000, milliseconds(60));
  EXPECT_TRUE(is_overloaded());
}

TEST_F(LoadGaugeTest, IsOverWhenNobodyWaitsAnyMore) {
  wait(50, milliseconds(500));
  ASSERT_TRUE(is_overloaded());
  now_ += milliseconds(2100);
  EXPECT_FALSE(is_overloaded());
}

}  // namespace
}  // namespace lpdeform
