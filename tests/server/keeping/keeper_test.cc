// What the keeper asks of a store as sessions come, move elsewhere and return. It never has two sessions of one name, and never
// reports as stored what is not written.

#include "server/keeping/keeper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <condition_variable>
#include <future>
#include <mutex>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "bar.h"
#include "core/base/fault.h"
#include "manual_timers.h"

namespace lpdeform {
namespace {

constexpr std::chrono::seconds kPatience{60};
const std::string kName = "sessions/0123456789abcdef0123456789abcdef";

/// Takes all, and writes down what it was asked for; a test can hold its changes up.
class NotingStore final : public Store {
 public:
  void hold_changes(bool is_held) {
    const std::scoped_lock lock(mutex_);
    is_held_ = is_held;
    changed_.notify_all();
  }

  /// Blobs, as large ones are on a slow way.
  void hold_blobs(bool are_held) {
    const std::scoped_lock lock(mutex_);
    are_blobs_held_ = are_held;
    changed_.notify_all();
  }

  /// Waits until something was asked for, so often.
  bool wait_for(const std::string& asked, int times = 1, std::chrono::milliseconds patience = kPatience) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience,
                             [&] { return std::count(asked_.begin(), asked_.end(), asked) >= times; });
  }
  std::vector<std::string> asked() {
    const std::scoped_lock lock(mutex_);
    return asked_;
  }
  void forget() {
    const std::scoped_lock lock(mutex_);
    asked_.clear();
  }
  /// Of the next change.
  void answer_once(ChangeOutcome outcome) {
    const std::scoped_lock lock(mutex_);
    next_ = outcome;
  }
  void lose_to_another() {
    const std::scoped_lock lock(mutex_);
    is_elsewhere_ = true;
  }
  void lose_session() {
    const std::scoped_lock lock(mutex_);
    is_missing_ = true;
  }
  /// What is only read from now on, after this time; OK: it is given.
  void fail_reads_with(const absl::Status& status, std::chrono::milliseconds after) {
    const std::scoped_lock lock(mutex_);
    read_failure_ = status;
    reading_takes_ = after;
  }
  /// Of all changes from now on; OK: they are taken.
  void fail_with(const absl::Status& status) {
    const std::scoped_lock lock(mutex_);
    failure_ = status;
  }
  /// The same of changes of this session alone, its removal aside.
  void refuse(const std::string& session, const absl::Status& status) {
    const std::scoped_lock lock(mutex_);
    refused_ = session;
    refusal_ = status;
  }
  StoredChange newest() {
    const std::scoped_lock lock(mutex_);
    return newest_;
  }

  absl::StatusOr<std::vector<ChangeOutcome>> commit(std::span<const StoredChange> changes) override {
    std::unique_lock lock(mutex_);
    note(absl::StrCat("commit of ", changes.size()));
    for (const StoredChange& change : changes)
      note(change.is_expiry ? "expiry" : (change.is_removal ? "removal" : "change"));
    if (!changes.empty()) newest_ = changes.back();
    if (newest_.is_recreated) note("recreated");
    changed_.wait(lock, [this] { return !is_held_; });
    if (!failure_.ok()) return failure_;
    for (const StoredChange& change : changes) {
      if (!refusal_.ok() && change.session == refused_ && !change.is_removal) return refusal_;
    }
    return std::vector<ChangeOutcome>(changes.size(), std::exchange(next_, ChangeOutcome::kKept));
  }
  absl::StatusOr<StoredSession> take_over(const std::string&, const std::string& owner,
                                          const std::string&) override {
    const std::scoped_lock lock(mutex_);
    note("take over");
    return StoredSession{.owner = owner, .epoch = ++epoch_, .parts = {{"head", ""}}};
  }
  absl::StatusOr<TouchResult> touch(std::span<const TouchedSession> sessions) override {
    const std::scoped_lock lock(mutex_);
    TouchResult result;
    if (std::exchange(is_missing_, false)) result.missing = {kName};
    if (std::exchange(is_elsewhere_, false)) {
      result.lost = {kName};
      note("lost");
    }
    for (const TouchedSession& one : sessions)
      note(one.is_being_made ? absl::StrCat("is being made ", one.epoch) : "is there");
    for (const TouchedSession& one : sessions) note(one.is_in_use ? "in use" : "not in use");
    note("touched");
    if (!read_failure_.ok()) return read_failure_;
    return result;
  }
  absl::Status release(const std::vector<HeldSession>& sessions) override {
    const std::scoped_lock lock(mutex_);
    note(absl::StrCat("released all ", sessions.size()));
    for (const HeldSession& session : sessions) note(absl::StrCat("released ", session.epoch));
    return absl::OkStatus();
  }
  std::chrono::milliseconds touch_every() const override { return kTouch; }
  absl::StatusOr<std::string> find_request(const std::string&, const std::string&) override {
    std::unique_lock lock(mutex_);
    note("find request");
    if (read_failure_.ok()) return "";
    changed_.wait_for(lock, reading_takes_, [] { return false; });
    return read_failure_;
  }
  absl::StatusOr<std::vector<std::string>> list(const std::string&, const std::string&,
                                                std::size_t) override {
    return std::vector<std::string>();
  }
  absl::Status keep_blob(const std::string&, const std::string& key, std::string_view) override {
    std::unique_lock lock(mutex_);
    note("blob " + key);
    changed_.wait(lock, [this] { return !are_blobs_held_; });
    return absl::OkStatus();
  }
  absl::StatusOr<std::string> blob(const std::string&) override { return ""; }
  absl::StatusOr<std::size_t> remove_unused(std::int64_t) override {
    const std::scoped_lock lock(mutex_);
    note("swept");
    return 0;
  }

  static constexpr std::chrono::milliseconds kTouch{300};

 private:
  /// Under the lock.
  void note(const std::string& what) {
    asked_.push_back(what);
    changed_.notify_all();
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> asked_;
  std::uint64_t epoch_ = 1;
  bool is_held_ = false, are_blobs_held_ = false, is_missing_ = false, is_elsewhere_ = false;
  ChangeOutcome next_ = ChangeOutcome::kKept;
  StoredChange newest_;
  absl::Status failure_, read_failure_, refusal_;
  std::string refused_;
  std::chrono::milliseconds reading_takes_{0};
};

class KeeperTest : public testing::Test {
 protected:
  KeeperTest() {  // the touch and the sweep at the start are not what a test asks for
    EXPECT_TRUE(store_->wait_for("swept"));
    store_->forget();
  }
  ~KeeperTest() override {
    store_->hold_changes(false);
    keeper_.reset();
  }

  std::shared_ptr<Session> session(const std::string& name = kName) {
    const auto shape = shape_of(bar_mesh());
    SessionParts parts{.name = name,
                       .shape = shape,
                       .deformer = deformer_of(shape),
                       .free_components = FreeComponents::kError,
                       .beginning = {},
                       .memory = {}};
    return *Session::create(std::move(parts), {scheduler_, timers_, std::chrono::seconds(15)});
  }

  /// A session that the store has.
  std::shared_ptr<Session> kept(const std::string& name = kName) {
    const auto made = session(name);
    std::promise<absl::Status> added;
    keeper_->add(made, {}, "", [&](const absl::Status& status) { added.set_value(status); });
    EXPECT_TRUE(added.get_future().get().ok());
    store_->forget();
    return made;
  }

  /// Three that the store has, while it is held up by a change of the first: what comes to them meanwhile waits together.
  std::vector<std::shared_ptr<Session>> three_that_wait() {
    const std::vector<std::shared_ptr<Session>> all{kept(), kept(kName + "a"), kept(kName + "b")};
    store_->hold_changes(true);
    keeper_->changed(*all[0], all[0]->revision() + 1, 0, [](bool) {});
    EXPECT_TRUE(store_->wait_for("commit of 1"));
    return all;
  }

  void take_over() {
    keeper_->take_over(kName, {"anna", ""},
                       [this](absl::StatusOr<Keeper::Found> found) { found_.set_value(std::move(found)); });
  }

  /// The reason; empty where it was answered.
  std::string find_request() {
    std::promise<std::string> reason;
    keeper_->find_request("anna", "request", [&](const absl::StatusOr<std::string>& name) {
      reason.set_value(fault_of(name.status()).reason);
    });
    return reason.get_future().get();
  }

  /// Lets time go by until the store counts as one that fails, or works.
  bool pass_until_failing(bool is_failing) {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (keeper_->is_failing() != is_failing) {
      if (std::chrono::steady_clock::now() > end) return false;
      timers_->advance(std::chrono::milliseconds(10));
    }
    return true;
  }

  /// Gives it an update and says whether it was kept.
  bool is_kept(Session& one, std::uint64_t seq) {
    Update update;
    update.input_seq = seq;
    update.settings.p = Field::Constant(1, 1 + 0.001 * static_cast<double>(seq));
    const auto taken = one.update(one.writer(one.lease().token), update);
    EXPECT_TRUE(taken.ok()) << taken.status();
    std::promise<bool> kept;
    keeper_->changed(one, one.revision(), 0, [&](bool is) { kept.set_value(is); });
    return kept.get_future().get();
  }
  /// Between two tries of a keeper that ends, which come after 100 and 300 ms.
  static constexpr std::chrono::milliseconds kSoon{250};
  static std::chrono::steady_clock::time_point soon() { return std::chrono::steady_clock::now() + kSoon; }

  bool shows(const std::string& line) const { return absl::StrContains(metrics_->text(), line + "\n"); }

  /// Lets time pass until something was asked for, at most ten times as fast as real time.
  bool pass_until(const std::string& asked) {
    const auto end = std::chrono::steady_clock::now() + kPatience;
    while (!store_->wait_for(asked, 1, std::chrono::milliseconds(1))) {
      if (std::chrono::steady_clock::now() > end) return false;
      timers_->advance(std::chrono::milliseconds(10));
    }
    return true;
  }

  /// Lets time pass until a touch tells the store what the keeper has now. It waits for two, because the first may have looked before.
  void pass_a_touch() {
    for (int k = 0; k < 2; ++k) {
      store_->forget();
      ASSERT_TRUE(pass_until("touched"));
    }
  }

  Scheduler scheduler_{2};
  const std::shared_ptr<ManualTimers> timers_ = std::make_shared<ManualTimers>();
  const std::shared_ptr<Metrics> metrics_ = std::make_shared<Metrics>();
  const std::shared_ptr<NotingStore> store_ = std::make_shared<NotingStore>();
  std::promise<absl::StatusOr<Keeper::Found>> found_;
  std::shared_ptr<Keeper> keeper_ =
      Keeper::create(store_, {timers_, metrics_, std::make_shared<Log>("off"), std::chrono::minutes(10)});
};

TEST_F(KeeperTest, OneThatLeavesIsWrittenBeforeItIsTakenOverAgain) {
  const auto leaving = kept();
  store_->hold_changes(true);
  keeper_->release(*leaving);
  ASSERT_TRUE(store_->wait_for("change"));
  take_over();
  timers_->advance(NotingStore::kTouch);
  ASSERT_TRUE(store_->wait_for("touched"));  // by the thread that takes over, afterwards
  for (const std::string& asked : store_->asked()) EXPECT_NE(asked, "take over");
  store_->hold_changes(false);
  ASSERT_TRUE(store_->wait_for("released 1"));
  ASSERT_TRUE(pass_until("take over"));
  EXPECT_TRUE(found_.get_future().get().ok());
}

TEST_F(KeeperTest, AnUpdateOfTheOneBeforeIsNotCalledKept) {
  const auto before = kept();
  store_->hold_changes(true);
  std::promise<bool> is_kept;
  const std::uint64_t next = before->revision() + 1;
  keeper_->changed(*before, next, 1, [&](bool kept) { is_kept.set_value(kept); });
  const auto back = session();
  keeper_->adopt(back, {.owner = "anna", .epoch = 7, .parts = {{"head", ""}}});
  EXPECT_FALSE(is_kept.get_future().get());
  std::promise<bool> is_late_one_kept;
  keeper_->changed(*before, 0, 0, [&](bool kept) { is_late_one_kept.set_value(kept); });
  EXPECT_FALSE(is_late_one_kept.get_future().get());
  std::promise<bool> is_new_one_kept;
  keeper_->changed(*back, 0, 0, [&](bool kept) { is_new_one_kept.set_value(kept); });
  EXPECT_TRUE(is_new_one_kept.get_future().get());
}

TEST_F(KeeperTest, TheOneBeforeTakesNothingFromTheOneThatCameBack) {
  const auto before = session(), back = kept();
  keeper_->release(*before);
  keeper_->expire(*before);
  ASSERT_TRUE(pass_until("is there"));
  EXPECT_FALSE(keeper_->is_being_removed(kName));
}

TEST_F(KeeperTest, OneThatIsBeingMadeIsHeldUntilItIsThereOrGivenUp) {
  take_over();
  ASSERT_TRUE(found_.get_future().get().ok());
  ASSERT_TRUE(pass_until("is being made 2"));
  keeper_->give_up(kName);
  ASSERT_TRUE(store_->wait_for("released 2"));
  pass_a_touch();
  for (const std::string& asked : store_->asked())
    EXPECT_TRUE(asked == "touched" || asked == "swept") << asked;

  found_ = std::promise<absl::StatusOr<Keeper::Found>>();
  take_over();
  const auto found = found_.get_future().get();
  ASSERT_TRUE(found.ok());
  keeper_->adopt(session(), found->session);
  pass_a_touch();
  const std::vector<std::string> asked = store_->asked();
  EXPECT_NE(std::find(asked.begin(), asked.end(), "is there"), asked.end());
  for (const std::string& one : asked) EXPECT_NE(one, "is being made 3");
}

TEST_F(KeeperTest, ASessionIsInUseAsLongAsItHasAStreamHoweverLongNobodyCalls) {
  const auto live = kept();
  const auto stream = live->open_stream(std::nullopt, {});
  ASSERT_TRUE(stream.ok());
  timers_->advance(2 * Keeper::kInUse);
  store_->forget();
  ASSERT_TRUE(pass_until("is there"));
  ASSERT_TRUE(store_->wait_for("touched"));
  for (const std::string& asked : store_->asked()) EXPECT_NE(asked, "not in use");
  live->forget_stream(**stream);
  ASSERT_TRUE(pass_until("not in use"));
}

TEST_F(KeeperTest, OneThatTheStoreHasLostIsWrittenAgainWithItsMesh) {
  const auto live = kept();
  const auto write = [&] { keeper_->changed(*live, live->revision() + 1, 0, [](bool) {}); };
  const auto expect_all = [&] {
    const StoredChange again = store_->newest();
    EXPECT_TRUE(again.is_recreated && again.replaces_all);
    for (const char* const part : {"head", "inputs", "writer"}) EXPECT_TRUE(again.parts.contains(part));
    ASSERT_EQ(again.blobs.size(), 1u);
    EXPECT_TRUE(store_->wait_for("blob " + again.blobs[0]));
  };
  store_->answer_once(ChangeOutcome::kLost);
  write();
  ASSERT_TRUE(store_->wait_for("recreated"));
  expect_all();
  keeper_->flush(std::chrono::steady_clock::now() + kPatience);
  store_->forget();
  write();
  ASSERT_TRUE(store_->wait_for("change"));
  EXPECT_FALSE(store_->newest().is_recreated);
  keeper_->flush(std::chrono::steady_clock::now() + kPatience);
  store_->lose_session();
  ASSERT_TRUE(pass_until("recreated"));
  expect_all();
}

TEST_F(KeeperTest, AnUpdateThatIsGivenUpIsMeasuredToo) {
  const auto live = kept();
  store_->hold_changes(true);
  std::promise<bool> is_kept;
  keeper_->changed(*live, live->revision() + 1, 0, [&](bool kept) { is_kept.set_value(kept); });
  timers_->advance(Keeper::kPatience);
  EXPECT_FALSE(is_kept.get_future().get());
  EXPECT_TRUE(shows("lpdeform_input_to_kept_seconds_count 1"));
  EXPECT_TRUE(shows("lpdeform_updates_not_kept_total 1"));
  EXPECT_TRUE(shows("lpdeform_store_failing 0"));
}

TEST_F(KeeperTest, AStoreThatCannotBeReachedFailsThoughNobodyWrites) {
  store_->fail_reads_with(store_failing("a test wants it to"), std::chrono::milliseconds(0));
  ASSERT_TRUE(pass_until_failing(true));
  EXPECT_TRUE(shows("lpdeform_store_failing 1"));
  store_->fail_reads_with(absl::OkStatus(), std::chrono::milliseconds(0));
  ASSERT_TRUE(pass_until_failing(false));
  EXPECT_TRUE(shows("lpdeform_store_failing 0"));
}

TEST_F(KeeperTest, WhoAsksAStoreThatFailsAtOnceAsksForItself) {
  store_->fail_reads_with(store_failing("a test wants it to"), std::chrono::milliseconds(0));
  EXPECT_EQ(find_request(), "STORE_FAILING");
  EXPECT_TRUE(keeper_->is_failing());
  store_->fail_reads_with(absl::OkStatus(), std::chrono::milliseconds(0));
  EXPECT_EQ(find_request(), "");
  EXPECT_FALSE(keeper_->is_failing());
}

TEST_F(KeeperTest, WhoAsksAStoreThatHangsIsRefusedAtOnceUntilItAnswers) {
  store_->fail_reads_with(store_away("a test wants it to"), Keeper::kPatience + Keeper::kPatience / 2);
  EXPECT_EQ(find_request(), "STORE_FAILING");
  for (int k = 0; k < 10; ++k) EXPECT_EQ(find_request(), "STORE_FAILING");
  const auto asked = store_->asked();
  EXPECT_EQ(std::count(asked.begin(), asked.end(), "find request"), 1);
  store_->fail_reads_with(absl::OkStatus(), std::chrono::milliseconds(0));
  ASSERT_TRUE(pass_until_failing(false));
  EXPECT_EQ(find_request(), "");
}

TEST_F(KeeperTest, AStoreWhoseCallNeverReturnsFailsAndWhoeverWaitsIsAnswered) {
  const auto live = kept();
  store_->hold_blobs(true);
  std::promise<absl::Status> added, removed;
  std::promise<std::string> asked;
  keeper_->add(session(kName + "a"), {.part = "", .blobs = {{"key", "mesh"}}}, "",
               [&](const absl::Status& status) { added.set_value(status); });
  ASSERT_TRUE(store_->wait_for("blob key"));
  keeper_->find_request("anna", "request", [&](const absl::StatusOr<std::string>& name) {
    asked.set_value(fault_of(name.status()).reason);
  });
  take_over();
  EXPECT_FALSE(keeper_->is_failing());
  ASSERT_TRUE(pass_until_failing(true));
  EXPECT_TRUE(shows("lpdeform_store_failing 1"));
  EXPECT_EQ(fault_of(added.get_future().get()).reason, "STORE_FAILING");
  EXPECT_EQ(asked.get_future().get(), "STORE_FAILING");
  EXPECT_EQ(fault_of(found_.get_future().get().status()).reason, "STORE_FAILING");
  EXPECT_FALSE(is_kept(*live, 1));  // at once
  store_->hold_blobs(false);
  ASSERT_TRUE(pass_until_failing(false));
  EXPECT_TRUE(shows("lpdeform_store_failing 0"));
  EXPECT_TRUE(store_->wait_for("removal"));  // of the one whose caller was told that it is not there
  EXPECT_EQ(find_request(), "");
  EXPECT_TRUE(is_kept(*live, 2));
}

TEST_F(KeeperTest, ADeletionIsAnsweredThoughTheStoreNeverReturns) {
  const auto live = kept();
  store_->hold_changes(true);
  std::promise<absl::Status> removed;
  keeper_->remove(live->name(), [&](const absl::Status& status) { removed.set_value(status); });
  ASSERT_TRUE(store_->wait_for("removal"));
  ASSERT_TRUE(pass_until_failing(true));
  EXPECT_EQ(fault_of(removed.get_future().get()).reason, "STORE_FAILING");
  store_->hold_changes(false);
  EXPECT_TRUE(pass_until_failing(false));
}

TEST(StoreCallsTest, ALargeMeshHasItsTimeBeforeTheStoreCountsAsOneThatHangs) {
  StoreCalls calls;
  const auto begin = StoreCalls::Clock::now();
  const StoreCalls::UnderWay large(calls, begin, std::size_t{10} << 20);
  EXPECT_FALSE(calls.is_any_late(begin + std::chrono::seconds(12)));
  EXPECT_TRUE(calls.is_any_late(begin + std::chrono::seconds(13)));
  const StoreCalls::UnderWay small(calls, begin);
  EXPECT_TRUE(calls.is_any_late(begin + std::chrono::milliseconds(2001)));
}

TEST_F(KeeperTest, AStoreThatHasRecoveredIsUsedAgainThoughNothingIsLeftToWrite) {
  std::promise<void> lost;
  keeper_->on_lost = [&](const Session&) { lost.set_value(); };
  const auto live = kept();
  store_->fail_with(store_failing("a test wants it to"));
  std::promise<bool> is_kept;
  keeper_->changed(*live, live->revision() + 1, 0, [&](bool kept) { is_kept.set_value(kept); });
  EXPECT_FALSE(is_kept.get_future().get());
  store_->lose_to_another();
  ASSERT_TRUE(pass_until("lost"));
  lost.get_future().get();
  store_->fail_with(absl::OkStatus());
  EXPECT_TRUE(pass_until_failing(false));
}

TEST_F(KeeperTest, WhileALargeMeshIsOnItsWayTheOtherSessionsStayHere) {
  const auto here = kept();
  store_->hold_blobs(true);
  std::promise<absl::Status> added;
  keeper_->add(session(kName + "a"), {.part = "", .blobs = {{"key", "mesh"}}}, "",
               [&](const absl::Status& status) { added.set_value(status); });
  ASSERT_TRUE(store_->wait_for("blob key"));
  timers_->advance(NotingStore::kTouch);
  EXPECT_TRUE(store_->wait_for("is there"));
  store_->hold_blobs(false);
  EXPECT_TRUE(added.get_future().get().ok());
}

TEST_F(KeeperTest, AStoreThatDoesNotAnswerIsAskedForAllAtOnceAndNotForEach) {
  const auto all = three_that_wait();
  for (const auto& one : all) keeper_->changed(*one, one->revision() + 1, 0, [](bool) {});
  store_->fail_with(store_away("a test wants it to"));
  store_->forget();
  store_->hold_changes(false);
  ASSERT_TRUE(store_->wait_for("commit of 3", 2));
  for (const std::string& asked : store_->asked()) EXPECT_NE(asked, "commit of 1");
}

TEST_F(KeeperTest, OneThatTheStoreRefusesDoesNotHoldUpTheOthers) {
  const auto all = three_that_wait();
  for (const auto& one : all) keeper_->changed(*one, one->revision() + 1, 0, [](bool) {});
  store_->fail_with(store_failing("a test wants it to"));
  store_->forget();
  store_->hold_changes(false);
  ASSERT_TRUE(store_->wait_for("commit of 3"));
  store_->forget();
  EXPECT_TRUE(store_->wait_for("commit of 1"));
}

TEST_F(KeeperTest, ThoseThatLeaveTogetherAreLetGoOfTogether) {
  const auto all = three_that_wait();
  for (const auto& one : all) keeper_->release(*one);
  store_->hold_changes(false);
  EXPECT_TRUE(store_->wait_for("released all 3"));
}

TEST_F(KeeperTest, OneThatNobodyUsedHereIsNotRemovedFromWhoHasIt) {
  const auto unused = kept();
  keeper_->expire(*unused);
  EXPECT_TRUE(store_->wait_for("expiry"));
}

TEST_F(KeeperTest, WhatAFullStoreRefusesHoldsNothingElseUp) {
  const auto large = kept(), small = kept(kName + "a");
  store_->refuse(kName, store_full("a test wants it to"));
  EXPECT_FALSE(is_kept(*large, 1));
  EXPECT_TRUE(shows("lpdeform_store_full 1"));
  EXPECT_TRUE(shows("lpdeform_store_failing 0"));
  EXPECT_EQ(fault_of(keeper_->may_keep(*large)).reason, "STORE_FULL");
  EXPECT_TRUE(keeper_->may_keep(*small).ok());
  for (std::uint64_t seq = 1; seq < 20; ++seq) EXPECT_TRUE(is_kept(*small, seq));
  std::promise<absl::Status> removed;
  keeper_->remove(kName + "a", [&](const absl::Status& status) { removed.set_value(status); });
  EXPECT_TRUE(removed.get_future().get().ok());
  store_->refuse("", absl::OkStatus());
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (!keeper_->may_keep(*large).ok() && std::chrono::steady_clock::now() < end) {
  }
  EXPECT_TRUE(is_kept(*large, 2));
  while (!shows("lpdeform_store_full 0") && std::chrono::steady_clock::now() < end)
    timers_->advance(std::chrono::seconds(1));
  EXPECT_TRUE(shows("lpdeform_store_full 0"));
}

TEST_F(KeeperTest, ANewSessionThatAFullStoreRefusesIsToldSo) {
  store_->refuse(kName, store_full("a test wants it to"));
  std::promise<absl::Status> added;
  keeper_->add(session(), {}, "", [&](const absl::Status& status) { added.set_value(status); });
  EXPECT_EQ(fault_of(added.get_future().get()).reason, "STORE_FULL");
  EXPECT_TRUE(store_->wait_for("removal"));
  EXPECT_TRUE(keeper_->flush(soon()).empty());  // nobody was told that it is kept
}

TEST_F(KeeperTest, TheEndWaitsForAStoreThatFailsAndSaysWhatItHasNotTaken) {
  const auto one = kept(), other = kept(kName + "a"), gone = kept(kName + "b"), never = kept(kName + "c");
  ASSERT_TRUE(is_kept(*one, 1));
  store_->fail_with(store_failing("a test wants it to"));
  for (std::uint64_t seq = 2; seq < 102; ++seq) EXPECT_FALSE(is_kept(*one, seq));
  keeper_->remove(gone->name());
  keeper_->release(*other);  // of which it has all
  keeper_->expire(*never);
  const auto begin = std::chrono::steady_clock::now();
  const auto left = keeper_->flush(soon());
  EXPECT_GE(std::chrono::steady_clock::now() - begin, kSoon);
  ASSERT_EQ(left.size(), 2u);
  EXPECT_EQ(left[0].name, kName);
  EXPECT_EQ(left[0].updates, 100u);
  EXPECT_EQ(left[0].kept_seq, 1u);
  EXPECT_EQ(left[0].input_seq, 101u);
  EXPECT_EQ(left[1].name, kName + "b");
  EXPECT_TRUE(left[1].is_removal);
  store_->fail_with(absl::OkStatus());
  store_->forget();
  keeper_.reset();
  EXPECT_TRUE(store_->asked().empty());  // what was said not to be kept is not
}

TEST_F(KeeperTest, TheEndAnswersAllWhoWaitForAStoreThatHangs) {
  const auto all = three_that_wait();
  std::promise<absl::Status> removed, added, removed_late;
  std::promise<bool> kept;
  auto is_removed = removed.get_future(), is_added = added.get_future(),
       is_removed_late = removed_late.get_future();
  auto is_kept = kept.get_future();
  keeper_->remove(all[0]->name(), [&](const absl::Status& status) { removed.set_value(status); });
  keeper_->add(session(kName + "c"), {}, "", [&](const absl::Status& status) { added.set_value(status); });
  keeper_->changed(*all[1], all[1]->revision() + 1, 0, [&](bool is) { kept.set_value(is); });
  const auto left = keeper_->flush(soon());
  ASSERT_FALSE(left.empty());
  EXPECT_EQ(left[0].name, all[0]->name());
  EXPECT_TRUE(left[0].is_removal);
  for (const auto& one : left) EXPECT_NE(one.name, kName + "c");  // nobody was told that it is there
  keeper_->remove(all[2]->name(), [&](const absl::Status& status) { removed_late.set_value(status); });
  for (auto* const answer : {&is_removed, &is_added, &is_removed_late}) {
    ASSERT_EQ(answer->wait_for(kPatience), std::future_status::ready);
    EXPECT_EQ(fault_of(answer->get()).reason, "STORE_FAILING");
  }
  ASSERT_EQ(is_kept.wait_for(kPatience), std::future_status::ready);
  EXPECT_FALSE(is_kept.get());
}

TEST_F(KeeperTest, TheEndNamesEverySessionHoweverManyThereAre) {
  constexpr std::size_t kMany = 300;
  keeper_ =
      Keeper::create(store_, {timers_, metrics_, std::make_shared<Log>("error"), std::chrono::minutes(10)});
  std::vector<std::shared_ptr<Session>> all;
  for (std::size_t k = 0; k < kMany; ++k) all.push_back(kept(absl::StrCat("sessions/", k)));
  store_->fail_with(store_failing("a test wants it to"));
  for (const auto& one : all) EXPECT_FALSE(is_kept(*one, 1));
  testing::internal::CaptureStderr();
  EXPECT_EQ(keeper_->flush(soon()).size(), kMany);
  keeper_.reset();  // the log, too: it writes what waits
  const std::string said = testing::internal::GetCapturedStderr();
  for (std::size_t k = 0; k < kMany; ++k)
    EXPECT_TRUE(absl::StrContains(said, absl::StrCat("\"session_not_kept\",\"session\":\"", k, "\""))) << k;
}

TEST_F(KeeperTest, TheEndTriesAgainAndNamesNothingWhereTheStoreWorksInTime) {
  const auto one = kept();
  store_->fail_with(store_failing("a test wants it to"));
  EXPECT_FALSE(is_kept(*one, 1));
  std::thread later([&] {
    store_->forget();
    EXPECT_TRUE(store_->wait_for("commit of 1", 2));
    store_->fail_with(absl::OkStatus());
  });
  EXPECT_TRUE(keeper_->flush(std::chrono::steady_clock::now() + kPatience).empty());
  later.join();
  EXPECT_EQ(store_->newest().revision, one->revision());
}

}  // namespace
}  // namespace lpdeform
