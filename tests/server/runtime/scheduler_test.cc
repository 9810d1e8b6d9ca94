#include "server/runtime/scheduler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <future>
#include <latch>
#include <utility>
#include <vector>

namespace lpdeform {
namespace {

class Job final : public Runnable {
 public:
  Job(bool is_heavy, std::function<bool()> slice, double weight = 1)
      : Runnable(is_heavy, weight), slice_(std::move(slice)) {}
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
  std::latch release(1);
  std::promise<void> first_runs, second_ran, light_ran;
  std::atomic<bool> has_second_run = false;
  {
    Scheduler scheduler(2);
    scheduler.wake(std::make_shared<Job>(true, [&] {
      first_runs.set_value();
      release.wait();
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
    release.count_down();
    second_ran.get_future().wait();
  }
}

TEST(Scheduler, WhoeverUsedLessTimeGoesFirst) {
  // One thread is kept busy, so the other one has to choose between the two all the time.
  std::latch release(1);
  std::promise<void> is_busy, done;
  std::atomic<int> small = 0, large = 0;
  Scheduler scheduler(2);
  scheduler.wake(std::make_shared<Job>(true, [&] {
    is_busy.set_value();
    release.wait();
    return false;
  }));
  is_busy.get_future().wait();
  scheduler.wake(std::make_shared<Job>(false, [&] {
    spin(std::chrono::milliseconds(5));
    return ++large < 50000 && small < 10000;
  }));
  scheduler.wake(std::make_shared<Job>(false, [&] {
    spin(std::chrono::microseconds(50));
    if (++small < 10000) return true;
    done.set_value();
    return false;
  }));
  done.get_future().wait();
  release.count_down();
  // Equal shares of time mean a hundred small slices for each large one; with turns in order it would be one.
  EXPECT_GE(small, 10000);
  EXPECT_LT(large, 2000);
}

/// A scheduler of two threads, one of which is busy, so that the other has to choose.
class OneThread {
 public:
  OneThread() {
    scheduler.wake(std::make_shared<Job>(true, [this] {
      is_busy_.set_value();
      release_.wait();
      return false;
    }));
    is_busy_.get_future().wait();
  }
  ~OneThread() { release_.count_down(); }

 private:
  std::latch release_{1};
  std::promise<void> is_busy_;

 public:
  Scheduler scheduler{2};
};

TEST(Scheduler, AnswersGoBeforeRefinements) {
  OneThread one;
  std::promise<void> done;
  std::latch all_wait(1);
  std::vector<char> order;
  const auto note = [&](char what) {
    order.push_back(what);
    if (order.size() == 6) done.set_value();
    return false;
  };
  one.scheduler.wake(std::make_shared<Job>(false, [&] {
    all_wait.wait();
    return false;
  }));
  std::vector<std::shared_ptr<Job>> jobs;
  for (int k = 0; k < 3; ++k) {
    one.scheduler.wake(jobs.emplace_back(std::make_shared<Job>(false, [&] {
      spin(std::chrono::milliseconds(100));  // far more than their share, beside answers that take no time
      return note('o');
    })));
    one.scheduler.wake(jobs.emplace_back(std::make_shared<Job>(false, [&] { return note('a'); })),
                       Urgency::kAnswer);
  }
  EXPECT_TRUE(one.scheduler.is_answer_waiting());
  one.scheduler.wake(jobs[4], Urgency::kAnswer);  // the last of the ordinary ones is to answer now
  all_wait.count_down();
  done.get_future().wait();
  // An ordinary one may come in between for its share of the time, but no two.
  const auto last_answer = std::find(order.rbegin(), order.rend(), 'a').base() - order.begin();
  EXPECT_LE(std::count(order.begin(), order.begin() + last_answer, 'o'), 1);
  EXPECT_FALSE(one.scheduler.is_answer_waiting());
}

TEST(Scheduler, RefinementsKeepAShareBesideEndlessAnswers) {
  std::promise<void> done;
  std::atomic<int> answers = 0, refinements = 0;
  std::vector<std::shared_ptr<Job>> answering;
  OneThread one;  // after what its jobs use: one may run yet
  for (int k = 0; k < 3; ++k) {
    answering.push_back(std::make_shared<Job>(false, [&, k] {
      spin(std::chrono::milliseconds(1));  // a thread that is held up counts as few of them
      ++answers;
      one.scheduler.wake(answering[static_cast<std::size_t>(k)],
                         Urgency::kAnswer);  // the next update is there
      return answers < 15000;
    }));
  }
  const auto refining = std::make_shared<Job>(false, [&] {
    spin(std::chrono::milliseconds(1));
    if (++refinements == 1000) done.set_value();
    return refinements < 1000;
  });
  for (const auto& job : answering) one.scheduler.wake(job, Urgency::kAnswer);
  one.scheduler.wake(refining);
  done.get_future().wait();
  EXPECT_GT(answers, 1000);   // three quarters of the time are theirs
  EXPECT_LT(answers, 15000);  // and no more
}

TEST(Scheduler, AHeavierWeightHasALargerShare) {
  std::promise<void> done;
  int plain = 0, weighty = 0;
  OneThread one;
  const auto job = [&](int& count, double weight) {
    return std::make_shared<Job>(
        false,
        [&] {
          spin(std::chrono::milliseconds(1));  // a thread that is held up for long counts for little
          ++count;
          if (plain + weighty == 2000) done.set_value();
          return plain + weighty < 2000;
        },
        weight);
  };
  one.scheduler.wake(job(plain, 1));
  one.scheduler.wake(job(weighty, 16));
  done.get_future().wait();
  EXPECT_GT(weighty, 2 * plain);
  EXPECT_GT(plain, 5);  // and nobody starves
}

TEST(Scheduler, LongWaitsAreOverload) {
  std::promise<void> done;
  std::vector<std::shared_ptr<Job>> jobs;
  std::atomic<int> slices = 0;
  std::atomic<bool> was_overloaded = false;
  OneThread one;
  EXPECT_FALSE(one.scheduler.is_overloaded());
  for (int k = 0; k < 50; ++k) {
    jobs.push_back(std::make_shared<Job>(false, [&] {
      spin(std::chrono::milliseconds(5));  // so that each waits for a quarter of a second
      was_overloaded = was_overloaded || one.scheduler.is_overloaded();
      if (++slices == 200) done.set_value();
      return slices < 200;
    }));
  }
  for (const auto& one_job : jobs) one.scheduler.wake(one_job);
  done.get_future().wait();
  EXPECT_TRUE(was_overloaded);
}

/// Every slice after the first is idle.
class IdleJob final : public Runnable {
 public:
  explicit IdleJob(std::function<bool()> slice) : Runnable(false), slice_(std::move(slice)) {}
  bool run() override {
    make_next_idle();
    return slice_();
  }

 private:
  std::function<bool()> slice_;
};

TEST(Scheduler, IdleSlicesRunWhileNothingElseWaits) {
  std::promise<void> ended;
  std::atomic<int> idle = 0;
  Scheduler scheduler(2);
  scheduler.wake(std::make_shared<IdleJob>([&] {
    if (++idle < 50) return true;
    ended.set_value();
    return false;
  }));
  ended.get_future().wait();
  EXPECT_EQ(idle, 50);
}

TEST(Scheduler, IdleSlicesWaitForAllOthersAndAreNoOverload) {
  std::promise<void> idle_runs, ended;
  std::atomic<int> idle = 0, ordinary = 0;
  std::atomic<int> idle_meanwhile = 0;
  std::atomic<int> awake = 0;
  std::array<bool, 3> are_awake{};
  {
    Scheduler scheduler(2);
    // Three that always have something to do on two threads: one of them always waits.
    const auto busy = [&](bool& is_awake) {
      spin(std::chrono::milliseconds(2));
      if (!std::exchange(is_awake, true)) ++awake;
      if (awake < 3) {
        idle_meanwhile = -idle;
        return true;
      }
      const int slices = ++ordinary;
      if (slices < 300) return true;
      if (slices == 300) {
        idle_meanwhile += idle;
        ended.set_value();
      }
      return false;
    };
    scheduler.wake(std::make_shared<IdleJob>([&] {
      if (++idle == 10) idle_runs.set_value();
      spin(std::chrono::microseconds(100));
      return true;
    }));
    idle_runs.get_future().wait();
    for (bool& is_awake : are_awake)
      scheduler.wake(std::make_shared<Job>(false, [busy, &is_awake] { return busy(is_awake); }));
    ended.get_future().wait();
    EXPECT_FALSE(scheduler.is_overloaded());
  }
  EXPECT_LE(idle_meanwhile, 50);  // some as the last of the three begins; while they run, none
}

TEST(Scheduler, AnIdleSliceThatIsWokenGoesWithItsNewUrgency) {
  std::latch release(1);
  std::promise<void> first_ran, blocked, answered;
  std::atomic<int> slices = 0;
  {
    Scheduler scheduler(2);
    const auto idle = std::make_shared<IdleJob>([&] {
      if (++slices == 1) first_ran.set_value();
      if (slices == 1) blocked.get_future().wait();
      if (slices == 2) answered.set_value();
      return slices < 2;
    });
    scheduler.wake(idle);
    first_ran.get_future().wait();
    // The other thread always has ordinary work, and more waits.
    std::atomic<bool> is_over = false;
    for (int k = 0; k < 3; ++k) {
      scheduler.wake(std::make_shared<Job>(false, [&] {
        spin(std::chrono::microseconds(200));
        return !is_over;
      }));
    }
    blocked.set_value();
    scheduler.wake(idle, Urgency::kAnswer);
    answered.get_future().wait();
    is_over = true;
    release.count_down();
  }
  EXPECT_EQ(slices, 2);
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
