// A process whose store hangs still ends, and its log is written.

#include "server/process_end.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <memory>
#include <thread>

namespace lpdeform {
namespace {

constexpr std::chrono::milliseconds kPatience{200};
constexpr std::chrono::seconds kForever{3600};

/// What does not end is a thread, and there are others in this process.
class ProcessEndTest : public testing::Test {
 protected:
  ProcessEndTest() { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

TEST_F(ProcessEndTest, WhatDoesNotEndByItselfIsEndedAndTheLogIsWritten) {
  const auto hang = [] {
    ProcessEnd end;
    const auto log = std::make_shared<const Log>("info");
    log->error("before", {});
    end.within(kPatience, 2, log, std::chrono::minutes(1));
    std::this_thread::sleep_for(kForever);
  };
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EXIT(hang(), testing::ExitedWithCode(2), "before(.|\n)*end_forced");
  EXPECT_GE(std::chrono::steady_clock::now() - begin, kPatience);
}

TEST_F(ProcessEndTest, ThatTheLogIsGoneDoesNotHoldItUp) {
  const auto hang = [] {
    ProcessEnd end;
    end.within(kPatience, 2, std::make_shared<const Log>("info"));
    std::this_thread::sleep_for(kForever);
  };
  EXPECT_EXIT(hang(), testing::ExitedWithCode(2), "");
}

TEST_F(ProcessEndTest, WhatEndsByItselfIsLeftAlone) {
  const auto log = std::make_shared<const Log>("off");
  ProcessEnd().within(kForever, 2, log);  // its destructor waits for the thread
}

}  // namespace
}  // namespace lpdeform
