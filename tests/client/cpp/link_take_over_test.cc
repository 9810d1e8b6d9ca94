// What happens to earlier errors when a session is taken over.

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/client/link_fixture.h"

namespace lpdeform::client {
namespace {

class TakeOverTest : public LinkTest {
 protected:
  /// Until the client waits for its next try, or nearly so.
  void wait_for_problem() {
    const auto start = std::chrono::steady_clock::now();
    while (link_->last_problem().ok() && std::chrono::steady_clock::now() - start < kPatience)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    EXPECT_FALSE(link_->last_problem().ok());
  }

  void expect_stream_of_ours(const std::shared_ptr<Stream>& stream) {
    ASSERT_NE(stream, nullptr);  // before the pause was over
    answered(stream, 2);
    EXPECT_EQ(open_.writer_token(), "another token");
  }

  static absl::Status busy(absl::StatusCode code) {
    return with_retry_after(absl::Status(code, "Come back later."), std::chrono::seconds(60));
  }
};

TEST_F(TakeOverTest, DoesNotWaitForThePauseBetweenTries) {
  open();
  opened_stream()->end(busy(absl::StatusCode::kResourceExhausted));
  wait_for_problem();
  ASSERT_TRUE(link_->take_over().ok());
  expect_stream_of_ours(rpc_->next_stream());
}

TEST_F(TakeOverTest, DoesNotWaitForAConnection) {
  open();
  rpc_->is_unreachable = true;
  opened_stream()->end(busy(absl::StatusCode::kUnavailable));
  wait_for_problem();
  ASSERT_TRUE(link_->take_over().ok());
  expect_stream_of_ours(rpc_->next_stream());
}

TEST_F(TakeOverTest, DoesNotWaitForTheNextTryToRecreateTheSession) {
  open();
  const auto stream = opened_stream();
  rpc_->create_ends = {busy(absl::StatusCode::kResourceExhausted)};
  stream->end(session_unknown());
  while (rpc_->created().size() < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  ASSERT_TRUE(link_->take_over().ok());
  expect_stream_of_ours(rpc_->next_stream());
  EXPECT_EQ(rpc_->created().size(), 2u);
}

TEST_F(TakeOverTest, BeginsTheCountOfStreamsThatDoNotFitAgain) {
  v1::DeformResponse misfit = frame(1, 0);
  misfit.mutable_event()->mutable_frame()->set_positions("abc");
  open();
  for (int round = 0; round < 2; ++round) {
    std::shared_ptr<Stream> stream = opened_stream();
    for (int k = 1; k < RecoveryRules::kMostMisfits; ++k) {
      ASSERT_NE(stream, nullptr);
      stream->say(misfit);
      stream = answered(rpc_->next_stream());
    }
    ASSERT_NE(stream, nullptr);
    stream->say(misfit);
    EXPECT_EQ(fault_of(next_frame().status()).reason, "FRAME_PARTS");
    ASSERT_TRUE(link_->take_over().ok());
  }
}

}  // namespace
}  // namespace lpdeform::client
