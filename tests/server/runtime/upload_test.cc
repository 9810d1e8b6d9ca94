#include "server/runtime/upload.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/base/crc32c.h"
#include "core/base/fault.h"
#include "manual_timers.h"
#include "server/runtime/refusals.h"

namespace lpdeform {
namespace {

constexpr std::size_t kPage = UploadBytes::kPage;

class UploadTest : public testing::Test {
 protected:
  std::shared_ptr<Upload> create(const std::string& bytes, const std::string& request_id = "") {
    auto upload = uploads_->create(request_id, bytes.size(), crc32c(bytes));
    EXPECT_TRUE(upload.ok()) << upload.status();
    return *upload;
  }

  static std::string reason(const absl::Status& status) { return fault_of(status).reason; }

  std::shared_ptr<ManualTimers> timers_ = std::make_shared<ManualTimers>();
  std::shared_ptr<Budget> budget_ = std::make_shared<Budget>(10 * kPage);
  std::shared_ptr<Uploads> uploads_ =
      std::make_shared<Uploads>(budget_, timers_, Uploads::Limits{8 * kPage, std::chrono::minutes(10)});
};

TEST_F(UploadTest, TakesPartsInAnyOrderAndTwice) {
  const auto upload = create("abcdefgh");
  EXPECT_EQ(upload->add(4, "ef")->received_bytes, 2u);
  EXPECT_EQ(upload->add(4, "ef")->received_bytes, 2u);
  EXPECT_EQ(upload->add(0, "abc")->received_bytes, 5u);
  EXPECT_EQ(reason(upload->bytes().status()), "UPLOAD_UNFINISHED");
  EXPECT_EQ(upload->add(2, "cde")->received_bytes, 6u);
  EXPECT_TRUE(upload->add(5, "fgh")->is_finished);
  EXPECT_EQ(*upload->bytes(), "abcdefgh");
  EXPECT_TRUE(upload->add(0, "zz")->is_finished);
  EXPECT_EQ(*upload->bytes(), "abcdefgh");
}

TEST_F(UploadTest, AWrongChecksumMeansBeginningAgain) {
  const auto upload = create("abcd");
  EXPECT_EQ(upload->add(0, "ab")->received_bytes, 2u);
  const auto wrong = upload->add(2, "xx");
  EXPECT_EQ(reason(wrong.status()), "UPLOAD_CHECKSUM");
  EXPECT_TRUE(absl::IsDataLoss(wrong.status()));
  EXPECT_EQ(upload->add(2, "cd")->received_bytes, 2u);
  EXPECT_TRUE(upload->add(0, "ab")->is_finished);
}

TEST_F(UploadTest, RefusesPartsThatDoNotFit) {
  const auto upload = create("abcd");
  EXPECT_EQ(reason(upload->add(3, "de").status()), "UPLOAD_PART_OUT_OF_RANGE");
  EXPECT_EQ(reason(upload->add(~std::uint64_t{0}, "d").status()), "UPLOAD_PART_OUT_OF_RANGE");
  EXPECT_EQ(reason(upload->add(0, "").status()), "UPLOAD_PART_SIZE");
  EXPECT_EQ(reason(upload->add(0, std::string(Upload::kMostPartBytes + 1, 'x')).status()),
            "UPLOAD_PART_SIZE");
}

TEST_F(UploadTest, RefusesSizesBeyondTheLimitsBeforeTakingMemory) {
  EXPECT_EQ(reason(uploads_->create("", 0, 0).status()), "UPLOAD_SIZE");
  EXPECT_EQ(reason(uploads_->create("", ~std::uint64_t{0}, 0).status()), "UPLOAD_SIZE");
  const auto first = create(std::string(6 * kPage, 'a'));
  ASSERT_TRUE(first->add(0, "a").ok());
  const auto second = uploads_->create("", 6 * kPage, 0);
  EXPECT_TRUE(absl::IsResourceExhausted(second.status()));
  EXPECT_EQ(reason(second.status()), "MEMORY_FULL");
}

TEST_F(UploadTest, AnnouncedUploadsLeaveAllMemoryToOthers) {
  std::vector<std::shared_ptr<Upload>> announced;
  for (int k = 0; k < 95; ++k) announced.push_back(create(std::string(8 * kPage, 'a')));
  EXPECT_EQ(budget_->used(), 0u);
  EXPECT_TRUE(budget_->reserve(10 * kPage).ok());
}

TEST_F(UploadTest, APartWithoutRoomLeavesTheUploadAsItIsAndMayComeAgain) {
  const auto budget = std::make_shared<Budget>(10 * UploadBytes::kStep);
  const auto uploads =
      std::make_shared<Uploads>(budget, timers_, Uploads::Limits{1 << 20, std::chrono::minutes(10)});
  const std::string bytes(3 * UploadBytes::kStep, 'a');
  const auto upload = *uploads->create("", bytes.size(), crc32c(bytes));
  const std::string_view first = std::string_view(bytes).substr(0, UploadBytes::kStep + 1),
                         second = std::string_view(bytes).substr(first.size());
  ASSERT_TRUE(upload->add(0, first).ok());
  EXPECT_EQ(budget->used(), 2 * UploadBytes::kStep);
  auto others = budget->reserve(8 * UploadBytes::kStep);
  ASSERT_TRUE(others.ok());
  for (int times = 0; times < 2; ++times) {
    const absl::Status refused = upload->add(first.size(), second).status();
    EXPECT_TRUE(absl::IsResourceExhausted(refused));
    EXPECT_EQ(reason(refused), "MEMORY_FULL");
    EXPECT_EQ(fault_of(refused).limit, "bytes <= 655360");
    EXPECT_GT(retry_after_ms(refused), 0u);
    EXPECT_EQ(budget->used(), 10 * UploadBytes::kStep);
  }
  EXPECT_EQ(upload->add(0, "a")->received_bytes, first.size());  // what is there may come again, however full
  *others = Reservation();
  EXPECT_TRUE(upload->add(first.size(), second)->is_finished);
  EXPECT_EQ(budget->used(), bytes.size());
  EXPECT_EQ(*upload->bytes(), bytes);
}

TEST_F(UploadTest, TheCallersShareBoundsWhatComesOfItsUploads) {
  const auto budget = std::make_shared<Budget>(1 << 20, 2 * UploadBytes::kStep);
  const auto uploads =
      std::make_shared<Uploads>(budget, timers_, Uploads::Limits{1 << 20, std::chrono::minutes(10)});
  const std::uint64_t size = 2 * UploadBytes::kStep;
  const auto first = *uploads->create("", size, 0, "alice"), second = *uploads->create("", size, 0, "alice");
  EXPECT_EQ(reason(uploads->create("", size + 1, 0, "alice").status()), "CALLER_MEMORY_FULL");
  ASSERT_TRUE(first->add(0, "a").ok());
  ASSERT_TRUE(second->add(0, "a").ok());
  EXPECT_EQ(reason(first->add(UploadBytes::kStep, "a").status()), "CALLER_MEMORY_FULL");
  EXPECT_TRUE((*uploads->create("", size, 0, "bob"))->add(0, "a").ok());
  uploads->remove(second->name(), "alice");
}

TEST_F(UploadTest, AWrongChecksumGivesItsMemoryBackUntilItComesAgain) {
  const auto upload = create("abcd");
  ASSERT_TRUE(upload->add(0, "ab").ok());
  EXPECT_EQ(budget_->used(), kPage);
  EXPECT_EQ(reason(upload->add(2, "xx").status()), "UPLOAD_CHECKSUM");
  EXPECT_EQ(budget_->used(), 0u);
  EXPECT_TRUE(upload->add(0, "abcd")->is_finished);
  EXPECT_EQ(budget_->used(), kPage);
}

TEST_F(UploadTest, OneOwnerHasSoManyUploadsAndNoMore) {
  const auto uploads = std::make_shared<Uploads>(
      budget_, timers_,
      Uploads::Limits{.most_bytes_each = 8, .idle = std::chrono::minutes(10), .most_uploads_each = 2});
  const auto first = *uploads->create("request-1", 8, 0, "alice");
  ASSERT_TRUE(uploads->create("", 8, 0, "alice").ok());
  const absl::Status third = uploads->create("", 8, 0, "alice").status();
  EXPECT_EQ(reason(third), "CALLER_UPLOADS_FULL");
  EXPECT_EQ(fault_of(third).limit, "uploads <= 2");
  EXPECT_GT(retry_after_ms(third), 0u);
  EXPECT_EQ(*uploads->create("request-1", 8, 0, "alice"), first);  // no other one
  EXPECT_TRUE(uploads->create("", 8, 0, "bob").ok());
  for (int k = 0; k < 10; ++k) EXPECT_TRUE(uploads->create("", 8, 0).ok());  // everybody's
  uploads->remove(first->name(), "alice");
  EXPECT_TRUE(uploads->create("", 8, 0, "alice").ok());
  timers_->advance(std::chrono::minutes(10));
  for (int k = 0; k < 2; ++k) EXPECT_TRUE(uploads->create("", 8, 0, "alice").ok());
}

TEST_F(UploadTest, RefusesAnIdThatWasUsedForAnother) {
  const auto budget = std::make_shared<Budget>(1 << 20);
  const auto uploads =
      std::make_shared<Uploads>(budget, timers_, Uploads::Limits{100, std::chrono::minutes(10)});
  const auto first = uploads->create("request-1", 10, 7);
  ASSERT_TRUE(first.ok());
  EXPECT_EQ(uploads->create("request-1", 10, 7).value(), *first);
  EXPECT_EQ(reason(uploads->create("request-1", 11, 7).status()), "REQUEST_ID_REUSED");
  EXPECT_EQ(reason(uploads->create("request-1", 10, 8).status()), "REQUEST_ID_REUSED");
}

TEST_F(UploadTest, RefusesTooManySmallOnes) {
  const auto budget = std::make_shared<Budget>(1 << 20);
  const auto uploads =
      std::make_shared<Uploads>(budget, timers_, Uploads::Limits{1, std::chrono::minutes(10)});
  for (std::size_t k = 0; k < Uploads::kMostUploads; ++k) ASSERT_TRUE(uploads->create("", 1, 0).ok());
  EXPECT_EQ(reason(uploads->create("", 1, 0).status()), "UPLOADS_FULL");
}

TEST_F(UploadTest, EmptyOnesMakeRoomAndThoseInUseDoNot) {
  const auto uploads = std::make_shared<Uploads>(
      budget_, timers_,
      Uploads::Limits{.most_bytes_each = 8, .idle = std::chrono::minutes(10), .most_uploads = 4});
  const auto in_use = *uploads->create("", 8, 0), first = *uploads->create("request-1", 8, 0),
             second = *uploads->create("", 8, 0), damaged = *uploads->create("", 1, 0);
  ASSERT_TRUE(in_use->add(0, "a").ok());
  EXPECT_EQ(reason(damaged->add(0, "x").status()), "UPLOAD_CHECKSUM");
  timers_->advance(std::chrono::seconds(4));
  const absl::Status refused = uploads->create("", 8, 0).status();
  EXPECT_EQ(reason(refused), "UPLOADS_FULL");
  EXPECT_EQ(retry_after_ms(refused), 6000u);
  EXPECT_TRUE(uploads->find(first->name()).ok());
  EXPECT_TRUE(uploads->find(damaged->name()).ok());
  timers_->advance(std::chrono::seconds(6));
  // By how long nobody has touched them.
  ASSERT_TRUE(uploads->create("", 8, 0).ok());
  EXPECT_EQ(reason(uploads->find(second->name()).status()), "UPLOAD_UNKNOWN");
  ASSERT_TRUE(uploads->create("", 8, 0).ok());
  ASSERT_TRUE(uploads->create("", 8, 0).ok());
  EXPECT_EQ(reason(uploads->find(first->name()).status()), "UPLOAD_UNKNOWN");
  EXPECT_EQ(reason(uploads->find(damaged->name()).status()), "UPLOAD_UNKNOWN");
  EXPECT_TRUE(uploads->find(in_use->name()).ok());
  EXPECT_EQ(uploads->size(), 4u);
  EXPECT_EQ(retry_after_ms(uploads->create("", 8, 0).status()), 10'000u);
  EXPECT_EQ(reason(first->add(0, "a").status()), "");  // who has it keeps it
}

TEST_F(UploadTest, ManyThatComeAndGoLeaveNoAlarms) {
  for (int k = 0; k < 1000; ++k) uploads_->remove(create("abcd")->name());
  EXPECT_LE(timers_->waiting(), 1u);
}

TEST_F(UploadTest, ComesInAnyOrderWhereItIsCutIntoAtMostTwiceAsManyPartsAsRuns) {
  const auto uploads = std::make_shared<Uploads>(std::make_shared<Budget>(1 << 20), timers_,
                                                 Uploads::Limits{1 << 20, std::chrono::minutes(10)});
  const std::string bytes(2 * Upload::kMostRuns, 'x');
  const auto upload = *uploads->create("", bytes.size(), crc32c(bytes));
  for (std::size_t k = 0; k < bytes.size(); k += 2) ASSERT_TRUE(upload->add(k, "x").ok());
  for (std::size_t k = 1; k < bytes.size(); k += 2) ASSERT_TRUE(upload->add(k, "x").ok()) << k;
  EXPECT_TRUE(upload->bytes().ok());
}

TEST_F(UploadTest, RefusesOneRunTooManyAndGoesOnWithWhatJoinsOne) {
  const auto uploads = std::make_shared<Uploads>(std::make_shared<Budget>(1 << 20), timers_,
                                                 Uploads::Limits{1 << 20, std::chrono::minutes(10)});
  const auto upload = *uploads->create("", 4 * Upload::kMostRuns, 0);
  for (std::size_t k = 0; k < Upload::kMostRuns; ++k) ASSERT_TRUE(upload->add(2 * k, "x").ok());
  const std::size_t apart = 3 * Upload::kMostRuns;
  EXPECT_EQ(reason(upload->add(apart, "x").status()), "UPLOAD_SCATTERED");
  EXPECT_EQ(upload->add(1, "x")->received_bytes, Upload::kMostRuns + 1);
  EXPECT_TRUE(upload->add(apart, "x").ok());  // two runs have become one
}

TEST_F(UploadTest, TheSameRequestIdGivesTheSameUpload) {
  const auto upload = create("abcd", "request-1");
  EXPECT_EQ(create("abcd", "request-1"), upload);
  EXPECT_NE(create("abcd", "request-2"), upload);
  EXPECT_EQ(reason(uploads_->create("short", 4, 0).status()), "REQUEST_ID");
}

TEST_F(UploadTest, DeletingItGivesItsMemoryAndItsIdBackAndMayBeRepeated) {
  const auto first = uploads_->create("request-1", 8, 0).value();
  ASSERT_TRUE(first->add(0, "a").ok());
  const std::string name = first->name();
  uploads_->remove(name);
  uploads_->remove(name);
  EXPECT_TRUE(absl::IsNotFound(uploads_->find(name).status()));
  const auto second = uploads_->create("request-1", 4, 0).value();
  EXPECT_NE(second->name(), name);
  ASSERT_TRUE(second->add(0, "a").ok());
  EXPECT_EQ(budget_->used(), 2 * kPage);  // one of them as long as `first` is held
}

TEST_F(UploadTest, GoesWhenNobodyTouchesItAndGivesItsMemoryBack) {
  const std::string name = create("abcd", "request-1")->name();
  ASSERT_TRUE(uploads_->find(name).value()->add(0, "a").ok());
  timers_->advance(std::chrono::minutes(9));
  EXPECT_TRUE(uploads_->find(name).ok());
  timers_->advance(std::chrono::minutes(9));
  EXPECT_TRUE(uploads_->find(name).ok());
  timers_->advance(std::chrono::minutes(10));
  EXPECT_EQ(reason(uploads_->find(name).status()), "UPLOAD_UNKNOWN");
  EXPECT_EQ(budget_->used(), 0u);
  EXPECT_NE(create("abcd", "request-1")->name(), name);
}

TEST(Budget, CountsCorrectionsBeyondItsLimit) {
  const auto budget = std::make_shared<Budget>(100);
  {
    auto first = budget->reserve(60);
    ASSERT_TRUE(first.ok());
    first->resize(150);
    EXPECT_EQ(budget->used(), 150u);
    EXPECT_FALSE(budget->reserve(1).ok());
    first->resize(40);
    EXPECT_TRUE(budget->reserve(60).ok());
  }
  EXPECT_EQ(budget->used(), 0u);
}

}  // namespace
}  // namespace lpdeform
