#include "server/runtime/caller_limits.h"

#include <gtest/gtest.h>

#include "core/base/fault.h"
#include "manual_timers.h"
#include "server/runtime/budget.h"
#include "server/runtime/refusals.h"

namespace lpdeform {
namespace {

using std::chrono::milliseconds;
constexpr std::size_t kMiB = 1 << 20;

class CallerLimitsTest : public testing::Test {
 protected:
  std::shared_ptr<CallerLimits> with(CallerLimits::Limits limits) const {
    return std::make_shared<CallerLimits>(timers_, limits);
  }
  const std::shared_ptr<ManualTimers> timers_ = std::make_shared<ManualTimers>();
};

TEST_F(CallerLimitsTest, StreamsAreCountedForEachCallerAndGivenBack) {
  const auto limits = with({.streams = 2});
  auto first = limits->enter_stream("alice"), second = limits->enter_stream("alice");
  ASSERT_TRUE(first.ok() && second.ok());
  const absl::Status third = limits->enter_stream("alice").status();
  EXPECT_EQ(fault_of(third).reason, "CALLER_STREAMS_FULL");
  EXPECT_EQ(fault_of(third).limit, "streams <= 2");
  EXPECT_TRUE(limits->enter_stream("bob").ok());
  first->reset();
  EXPECT_TRUE(limits->enter_stream("alice").ok());
}

TEST_F(CallerLimitsTest, APlaceMayOutliveTheLimits) {
  auto limits = with({.streams = 1});
  const auto place = limits->enter_stream("alice");
  limits.reset();
}

TEST_F(CallerLimitsTest, EverybodyIsNoCaller) {
  const auto limits = with({.streams = 1, .upload_bytes_per_second = 1});
  for (int k = 0; k < 10; ++k) {
    EXPECT_TRUE(limits->enter_stream("").ok());
    EXPECT_TRUE(limits->take_upload_bytes("", kMiB).ok());
  }
}

TEST_F(CallerLimitsTest, UploadsMayBurstAndThenKeepToTheRateAndAreToldWhen) {
  const auto limits = with({.upload_bytes_per_second = kMiB});
  for (int k = 0; k < 4; ++k) ASSERT_TRUE(limits->take_upload_bytes("alice", kMiB).ok()) << k;
  const absl::Status refused = limits->take_upload_bytes("alice", kMiB / 2);
  EXPECT_EQ(fault_of(refused).reason, "UPLOAD_RATE");
  ASSERT_EQ(retry_after_ms(refused), 500u);
  EXPECT_TRUE(limits->take_upload_bytes("bob", kMiB).ok());
  timers_->advance(milliseconds(499));
  EXPECT_FALSE(limits->take_upload_bytes("alice", kMiB / 2).ok());
  timers_->advance(milliseconds(1));
  EXPECT_TRUE(limits->take_upload_bytes("alice", kMiB / 2).ok());
  EXPECT_FALSE(limits->take_upload_bytes("alice", kMiB / 2).ok());
}

TEST_F(CallerLimitsTest, ManyCallersAreForgottenButNotThoseInDebt) {
  const auto limits = with({.upload_bytes_per_second = 1});
  for (int k = 0; k < 4; ++k) ASSERT_TRUE(limits->take_upload_bytes("alice", kMiB).ok());
  for (std::size_t k = 0; k < 2 * CallerLimits::kMostBuckets; ++k) {
    ASSERT_TRUE(limits->take_upload_bytes(std::to_string(k), 1).ok());
    timers_->advance(milliseconds(1));
  }
  EXPECT_FALSE(limits->take_upload_bytes("alice", kMiB).ok());
}

TEST(Budget, OneOwnerCannotTakeAll) {
  const auto budget = std::make_shared<Budget>(100, 60);
  auto first = budget->reserve(50, "alice");
  ASSERT_TRUE(first.ok());
  const absl::Status refused = budget->reserve(20, "alice").status();
  EXPECT_EQ(fault_of(refused).reason, "CALLER_MEMORY_FULL");
  EXPECT_EQ(fault_of(refused).limit, "bytes <= 60");
  EXPECT_TRUE(budget->reserve(40, "bob").ok());
  EXPECT_TRUE(budget->reserve(20).ok());  // everybody's
  first->resize(30);
  EXPECT_TRUE(budget->reserve(20, "alice").ok());
  Reservation moved = *std::move(first);
  EXPECT_EQ(fault_of(budget->reserve(31, "alice").status()).reason, "CALLER_MEMORY_FULL");
  moved = Reservation();
  EXPECT_TRUE(budget->reserve(60, "alice").ok());
  EXPECT_EQ(budget->used(), 0u);
}

TEST(Budget, AReservationGrowsWhereThereIsRoom) {
  const auto budget = std::make_shared<Budget>(100, 60);
  auto grown = budget->reserve(20, "alice");
  ASSERT_TRUE(grown.ok());
  EXPECT_TRUE(grown->grow_to(10).ok());
  EXPECT_EQ(grown->bytes(), 20u);
  EXPECT_TRUE(grown->grow_to(50).ok());
  EXPECT_EQ(budget->used(), 50u);
  EXPECT_EQ(fault_of(grown->grow_to(61)).reason, "CALLER_MEMORY_FULL");
  const auto other = budget->reserve(45, "bob");
  EXPECT_EQ(fault_of(grown->grow_to(60)).reason, "MEMORY_FULL");
  EXPECT_EQ(grown->bytes(), 50u);
  grown = Reservation();
  EXPECT_EQ(budget->used(), 45u);
}

TEST(RetryAdvice, IsWhatWasGivenElseByTheCode) {
  EXPECT_EQ(retry_after_ms(absl::OkStatus()), 0u);
  EXPECT_EQ(retry_after_ms(absl::InvalidArgumentError("")), 0u);
  EXPECT_EQ(retry_after_ms(absl::ResourceExhaustedError("")), 5000u);
  const absl::Status error = absl::ResourceExhaustedError("");
  EXPECT_EQ(retry_after_ms(retry_after(error, milliseconds(1234))), 1234u);
  EXPECT_EQ(retry_after_ms(retry_after(error, milliseconds(0))), 1u);  // 0 would say that it does not help
  EXPECT_EQ(retry_after_ms(retry_after(error, std::chrono::hours(100))), 3600u * 1000);
  EXPECT_EQ(fault_of(retry_after(server_draining(), milliseconds(7))).reason, "DRAINING");
}

}  // namespace
}  // namespace lpdeform
