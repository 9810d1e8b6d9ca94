// Updates that are sent again.

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/client/link_fixture.h"

namespace lpdeform::client {
namespace {

TEST_F(LinkTest, SendsAgainWhatWasAnsweredAndLostWithTheServer) {
  open();
  const auto first = opened_stream();
  link_->update(adding("tip")).value();
  first->hear();
  first->say(result(1, true));
  link_->update(adding("ear")).value();
  first->hear();
  first->say(result(2, false));
  first->say(frame(1, 2));
  EXPECT_TRUE(next_frame().ok());  // so it was read
  first->end(absl::UnavailableError("killed"));
  const auto second = answered(rpc_->next_stream(), 2, 1);
  std::optional<v1::DeformRequest> again = second->hear();
  while (again && again->has_ack()) again = second->hear();
  ASSERT_TRUE(again && again->has_update());
  EXPECT_EQ(again->update().input_seq(), 2u);
  ASSERT_EQ(again->update().handles_size(), 1);
  EXPECT_EQ(again->update().handles(0).name(), "ear");
}

TEST_F(LinkTest, SendsAgainAnUpdateWhoseUploadsTheServerDoesNotKnow) {
  open();
  const auto first = opened_stream();
  link_->update(adding("tip")).value();
  first->hear();
  v1::DeformResponse fault = refusal(1);
  fault.mutable_event()->mutable_fault()->set_code(5);
  fault.mutable_event()->mutable_fault()->set_reason("UPLOAD_UNKNOWN");
  first->say(fault);
  const auto second = answered(rpc_->next_stream());
  const auto again = second->hear();
  ASSERT_TRUE(again && again->has_update());
  EXPECT_EQ(again->update().input_seq(), 1u);
  second->say(fault);  // once is enough
  EXPECT_EQ(fault_of(next_frame().status()).reason, "UPLOAD_UNKNOWN");
}

/// One as large goes ahead as an upload.
Update large() {
  Update update;
  update.settings.p = std::vector<double>(200'000, 1.5);
  return update;
}

TEST_F(LinkTest, SendsLostUploadsAgainOnceAlsoWhereTheUpdateWasAskedForForAnotherReason) {
  open();
  const auto first = opened_stream();
  link_->update(adding("tip")).value();
  first->hear();
  first->say(fault(1, absl::StatusCode::kResourceExhausted, "SERVER_BUSY", 1));
  const v1::DeformResponse unknown = fault(1, absl::StatusCode::kNotFound, "UPLOAD_UNKNOWN");
  const auto second = answered(rpc_->next_stream());
  ASSERT_TRUE(second->hear());
  second->say(unknown);
  const auto third = answered(rpc_->next_stream());
  ASSERT_NE(third, nullptr);
  const auto again = third->hear();
  ASSERT_TRUE(again && again->has_update());
  EXPECT_EQ(again->update().input_seq(), 1u);
  third->say(unknown);
  EXPECT_EQ(fault_of(next_frame().status()).reason, "UPLOAD_UNKNOWN");
}

TEST_F(LinkTest, AnUploadThatTheServerHasNoRoomForIsTriedAgainAfterThePauseThatItAsksFor) {
  open();
  rpc_->upload_ends = {full("UPLOADS_FULL", std::chrono::milliseconds(300))};
  const auto first = opened_stream();
  const auto start = std::chrono::steady_clock::now();
  link_->update(large()).value();
  const auto next = rpc_->next_stream();
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(300));
  EXPECT_EQ(fault_of(link_->last_problem()).reason, "UPLOADS_FULL");
  const auto second = answered(next);
  ASSERT_NE(second, nullptr);
  const auto again = second->hear();
  ASSERT_TRUE(again && again->has_update());
  EXPECT_EQ(again->update().input_seq(), 1u);
}

TEST_F(LinkTest, SendsAPartAgainThatTheServerHasNoRoomForYet) {
  const std::chrono::milliseconds asked(200);
  rpc_->part_ends = {absl::OkStatus(), full("UPLOAD_RATE", asked), full("UPLOAD_RATE", asked)};
  const auto start = std::chrono::steady_clock::now();
  open(200'000);  // 2.4 MB of indices
  EXPECT_GE(std::chrono::steady_clock::now() - start, 2 * asked);
  const std::uint64_t part = 1 << 20;
  EXPECT_EQ(rpc_->parts(), (std::vector<std::uint64_t>{0, part, part, part, 2 * part}));
}

TEST_F(LinkTest, SendsAPartAgainForNoLongerThanACallMayTake) {
  const auto parts_after = [this](const absl::Status& refused) {
    rpc_->part_ends = {refused};
    Uploads uploads(*rpc_, std::stop_token());
    EXPECT_EQ(uploads.add(std::string(1000, 'a')).status(), refused);
    return rpc_->parts().size();
  };
  rpc_->longest_call = std::chrono::milliseconds(100);
  EXPECT_EQ(parts_after(full("UPLOAD_RATE", std::chrono::seconds(50))), 1u);
  EXPECT_EQ(parts_after(full("CALLER_MEMORY_FULL", {})), 2u);  // nor where it says of no pause
}

TEST_F(LinkTest, AClosedSessionWaitsForNoPart) {
  open();
  opened_stream();
  rpc_->longest_call = std::chrono::minutes(2);
  rpc_->part_ends = {full("UPLOAD_RATE", std::chrono::seconds(59))};
  link_->update(large()).value();
  const auto start = std::chrono::steady_clock::now();
  while (rpc_->parts().empty() && std::chrono::steady_clock::now() - start < kPatience)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(link_->close().ok());
  EXPECT_LT(std::chrono::steady_clock::now() - start, kPatience);
}

TEST_F(LinkTest, AnUploadForAStreamThatHasEndedIsBegunAgainForTheNext) {
  open();
  const auto first = opened_stream();
  rpc_->longest_call = std::chrono::minutes(2);
  rpc_->part_ends = {full("UPLOAD_RATE", std::chrono::seconds(59))};
  link_->update(large()).value();
  const auto start = std::chrono::steady_clock::now();
  while (rpc_->parts().empty() && std::chrono::steady_clock::now() - start < kPatience)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  first->end(absl::UnavailableError("killed"));
  const auto next = rpc_->next_stream();
  ASSERT_NE(next, nullptr);
  EXPECT_EQ(link_->last_problem(), absl::UnavailableError("killed"));
  const auto sent = answered(next)->hear();
  EXPECT_TRUE(sent && sent->has_update());
}

TEST_F(LinkTest, WhatKeepsAnUpdateFromBeingSolvedForIsNothingOnceANewerOneIsThere) {
  open();
  const auto stream = opened_stream();
  const v1::DeformResponse earlier = fault(1, absl::StatusCode::kFailedPrecondition, "NO_HANDLES");
  link_->update(Update()).value();
  ASSERT_TRUE(stream->hear());
  stream->say(earlier);
  EXPECT_EQ(fault_of(next_frame().status()).reason, "NO_HANDLES");  // so far it is the newest
  link_->update(adding("tip")).value();
  ASSERT_TRUE(stream->hear());
  stream->say(earlier);
  stream->say(frame(1, 1));
  EXPECT_TRUE(next_frame().ok());
  stream->say(fault(2, absl::StatusCode::kFailedPrecondition, "COMPONENT_WITHOUT_HANDLE"));
  EXPECT_EQ(fault_of(next_frame().status()).reason, "COMPONENT_WITHOUT_HANDLE");
}

TEST_F(LinkTest, SendsAnUpdateAgainAfterThePauseThatTheServerAsksFor) {
  open();
  const auto first = opened_stream();
  link_->update(adding("tip")).value();
  first->hear();
  v1::DeformResponse busy = refusal(1);
  busy.mutable_event()->mutable_fault()->set_code(8);
  busy.mutable_event()->mutable_fault()->set_reason("SERVER_BUSY");
  busy.mutable_event()->mutable_fault()->set_retry_after_ms(200);
  const auto start = std::chrono::steady_clock::now();
  first->say(busy);
  const auto second = answered(rpc_->next_stream());
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(200));
  const auto again = second->hear();
  ASSERT_TRUE(again && again->has_update());
  EXPECT_EQ(again->update().input_seq(), 1u);
}

}  // namespace
}  // namespace lpdeform::client
