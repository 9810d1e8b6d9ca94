// Updates that are sent again.

#include <gtest/gtest.h>

#include <chrono>

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
