#include "client/cli/server_access.h"

#include <gtest/gtest.h>

#include <chrono>

namespace lpdeform::cli {
namespace {

TEST(ServerAccess, SetsNoLimitToCallsOfTheServerInThisProcess) {
  const auto in_this_process = client_options(ServerAccess()).value();
  EXPECT_GE(in_this_process.call_timeout, std::chrono::hours(24 * 365));
  // Added to a clock's time, as the client does.
  EXPECT_GT(std::chrono::system_clock::now() + in_this_process.call_timeout,
            std::chrono::system_clock::now());
  EXPECT_GT(std::chrono::steady_clock::now() + in_this_process.call_timeout,
            std::chrono::steady_clock::now());
}

TEST(ServerAccess, KeepsTheClientsLimitForAServerThatMayBeAway) {
  ServerAccess access;
  access.address = "localhost:50051";
  EXPECT_EQ(client_options(access).value().call_timeout, client::ClientOptions().call_timeout);
}

}  // namespace
}  // namespace lpdeform::cli
