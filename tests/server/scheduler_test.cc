#include "server/scheduler.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <latch>

namespace lpdeform {
namespace {

class Job final : public Runnable {
 public:
  Job(bool is_heavy, std::function<bool()> slice) : Runnable(is_heavy), slice_(std::move(slice)) {}
  bool run() override { return slice_(); }

 private:
  std::function<bool()> slice_;
};

void spin(std::chrono::microseconds duration) {
  const auto end = std::chrono::steady_clock::now() + duration;
  while (std::chrono::steady_clock::now() < end) {
  }
}

TEST(Scheduler, HeavyOnesNeverTakeAllThreads) {
  std::latch let_go(1);
  std::promise<void> first_runs, second_ran, light_ran;
  std::atomic<bool> has_second_run = false;
  {
    Scheduler scheduler(2);
    scheduler.wake(std::make_shared<Job>(true, [&] {
      first_runs.set_value();
      let_go.wait();
      return false;
    }));
    first_runs.get_future().wait();
    scheduler.wake(std::make_shared<Job>(true, [&] {
      has_second_run = true;
      second_ran.set_value();
      return false;
    }));
    scheduler.wake(std::make_shared<Job>(false, [&] {
      light_ran.set_value();
      return false;
    }));
    light_ran.get_future().wait();
    EXPECT_FALSE(has_second_run);
    let_go.count_down();
    second_ran.get_future().wait();
  }
}

TEST(Scheduler, WhoeverUsedLessTimeGoesFirst) {
  // One thread is kept busy, so the other one has to choose between the two all the time.
  std::latch let_go(1);
  std::promise<void> is_busy, done;
  std::atomic<int> small = 0, large = 0;
  Scheduler scheduler(2);
  scheduler.wake(std::make_shared<Job>(true, [&] {
    is_busy.set_value();
    let_go.wait();
    return false;
  }));
  is_busy.get_future().wait();
  scheduler.wake(std::make_shared<Job>(false, [&] {
    spin(std::chrono::milliseconds(5));
    return ++large < 1000 && small < 200;
  }));
  scheduler.wake(std::make_shared<Job>(false, [&] {
    spin(std::chrono::microseconds(50));
    if (++small < 200) return true;
    done.set_value();
    return false;
  }));
  done.get_future().wait();
  let_go.count_down();
  // Equal shares of time mean a hundred small slices for each large one; with turns in order it would be one.
  EXPECT_GE(small, 200);
  EXPECT_LT(large, 40);
}

TEST(Scheduler, WakingOneThatRunsMakesItRunAgain) {
  std::promise<void> runs, again;
  std::latch go_on(1);
  int slices = 0;
  Scheduler scheduler(2);
  const auto job = std::make_shared<Job>(false, [&] {
    if (++slices == 1) {
      runs.set_value();
      go_on.wait();
    } else {
      again.set_value();
    }
    return false;
  });
  scheduler.wake(job);
  runs.get_future().wait();
  scheduler.wake(job);
  scheduler.wake(job);
  go_on.count_down();
  again.get_future().wait();
  EXPECT_EQ(slices, 2);
}

TEST(Scheduler, NeverRunsTwoSlicesOfOneAtATime) {
  std::atomic<int> inside = 0;
  std::atomic<bool> overlapped = false;
  std::atomic<int> slices = 0;
  std::promise<void> done;
  Scheduler scheduler(4);
  const auto job = std::make_shared<Job>(false, [&] {
    if (++inside > 1) overlapped = true;
    spin(std::chrono::microseconds(20));
    --inside;
    if (++slices == 2000) done.set_value();
    return slices < 2000;
  });
  for (int k = 0; k < 1000; ++k) scheduler.wake(job);
  done.get_future().wait();
  EXPECT_FALSE(overlapped);
}

TEST(Scheduler, RunsAJobOnce) {
  std::promise<int> done;
  Scheduler scheduler(2);
  scheduler.run_once([&] { done.set_value(7); });
  EXPECT_EQ(done.get_future().get(), 7);
}

}  // namespace
}  // namespace lpdeform
