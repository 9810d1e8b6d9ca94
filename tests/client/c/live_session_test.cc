// How a session of the C interface is opened; the test chooses the results of opening.

#include "client/c/live_session.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <string>

#include "client/cpp/status_details.h"
#include "core/base/fault.h"
#include "tests/client/c/session_fixture.h"

namespace lpdeform::engine {
namespace {

/// What the state says once `opening` has been called `calls` times, or the session is refused.
lpdeform_state state_after(int calls, const Opening& opening, absl::Status& why) {
  std::atomic<int> count = 0;
  LiveSession session(
      [&](const std::stop_token& stop) {
        ++count;
        return opening(stop);
      },
      {});
  EXPECT_TRUE(eventually([&] { return count >= calls || session.state(why) == LPDEFORM_STATE_REFUSED; }));
  return session.state(why);
}

absl::Status failure(absl::StatusCode code, const char* reason) {
  return carry_fault(code, {reason, "", ""}, "A text.");
}

TEST(LiveSession, WhatMayPassIsTriedAgain) {
  for (const absl::Status& passing :
       {absl::CancelledError("The server goes down."), failure(absl::StatusCode::kNotFound, "UPLOAD_UNKNOWN"),
        failure(absl::StatusCode::kUnavailable, "DRAINING"), absl::DeadlineExceededError("late"),
        client::with_retry_after(failure(absl::StatusCode::kResourceExhausted, "SESSIONS_FULL"),
                                 std::chrono::milliseconds(1))}) {
    absl::Status why;
    EXPECT_EQ(state_after(
                  3, [&](const std::stop_token&) { return passing; }, why),
              LPDEFORM_STATE_CONNECTING)
        << passing;
    EXPECT_EQ(why, passing);
  }
}

TEST(LiveSession, WhatStaysIsFinal) {
  for (const absl::Status& final :
       {failure(absl::StatusCode::kNotFound, "SESSION_UNKNOWN"),
        failure(absl::StatusCode::kInvalidArgument, "MESH_EMPTY"), absl::UnauthenticatedError("no token"),
        failure(absl::StatusCode::kResourceExhausted, "CALLER_SESSIONS_FULL")}) {
    absl::Status why;
    EXPECT_EQ(state_after(
                  2, [&](const std::stop_token&) { return final; }, why),
              LPDEFORM_STATE_REFUSED);
    EXPECT_EQ(why, final);
  }
}

TEST(LiveSession, AnExceptionOnItsThreadBecomesItsState) {
  absl::Status why;
  const auto throws = [](const std::stop_token&) -> absl::StatusOr<client::Session> {
    throw std::runtime_error("No thread is left.");
  };
  EXPECT_EQ(state_after(2, throws, why), LPDEFORM_STATE_REFUSED);
  EXPECT_EQ(fault_of(why).reason, "EXCEPTION");
  EXPECT_EQ(why.message(), "No thread is left.");
  const auto no_memory = [](const std::stop_token&) -> absl::StatusOr<client::Session> {
    throw std::bad_alloc();
  };
  state_after(3, no_memory, why);
  EXPECT_EQ(fault_of(why).reason, "OUT_OF_MEMORY");
}

TEST(LiveSession, StoppingEndsAnOpeningUnderWay) {
  std::atomic<bool> has_begun = false;
  LiveSession session(
      [&](const std::stop_token& stop) -> absl::StatusOr<client::Session> {
        has_begun = true;
        while (!stop.stop_requested()) std::this_thread::yield();
        return absl::CancelledError("stopped");
      },
      {});
  EXPECT_TRUE(eventually([&] { return has_begun.load(); }));
  session.close();
  EXPECT_FALSE(session.is_closed());  // what was begun is finished, and then deleted
  session.stop();
  session.wait_until_closed();
  EXPECT_TRUE(session.is_closed());
}

}  // namespace
}  // namespace lpdeform::engine
