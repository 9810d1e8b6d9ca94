// What every store promises, and how the folder of the SQLite store behaves when it is damaged, full or taken.

#include "server/store/store.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "redis_server.h"
#include "server/store/redis_store.h"
#include "server/store/sqlite_store.h"

namespace lpdeform {
namespace {

std::string reason(const absl::Status& status) {
  return fault_of(status).reason;
}

/// A folder for one test.
class Folder {
 public:
  Folder() {
    char name[] = "/tmp/lpdeform-store-XXXXXX";
    path_ = mkdtemp(name);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  const std::string& path() const { return path_; }
  std::size_t blobs() const {
    return static_cast<std::size_t>(std::distance(std::filesystem::directory_iterator(path_ + "/blobs"),
                                                  std::filesystem::directory_iterator()));
  }

 private:
  std::string path_;
};

/// The epoch of a session in its first, once it was taken over.
constexpr std::uint64_t kSecondLife = 1 + kEpochsOfALife;

StoredChange beginning(const std::string& name) {
  return {.session = name,
          .epoch = 1,
          .owner = "anna",
          .parts = {{"head", "h"}, {"inputs", "1"}, {"m:tip", "here"}}};
}

absl::StatusOr<ChangeOutcome> commit(Store& store, const StoredChange& change) {
  const auto outcomes = store.commit({&change, 1});
  if (!outcomes.ok()) return outcomes.status();
  return outcomes->at(0);
}

/// What holds for every store: "sqlite" and "redis".
class StoreTest : public testing::TestWithParam<std::string> {
 protected:
  void SetUp() override {
    if (GetParam() == "redis") redis_ = std::make_unique<RedisServer>(folder_.path());
    open();
  }
  /// As another process would, after the end of the one before.
  void open() {
    store_.reset();
    auto opened = redis_ ? open_redis_store({.host = "127.0.0.1", .port = redis_->port()})
                         : open_sqlite_store({folder_.path()});
    ASSERT_TRUE(opened.ok()) << opened.status();
    store_ = *std::move(opened);
  }

  Folder folder_;
  std::unique_ptr<RedisServer> redis_;
  std::shared_ptr<Store> store_;
};

INSTANTIATE_TEST_SUITE_P(Kinds, StoreTest, testing::Values("sqlite", "redis"),
                         [](const auto& info) { return info.param; });

class SqliteStoreTest : public testing::Test {
 protected:
  void SetUp() override { open(); }
  void open(std::uint64_t most_bytes = 0) {
    store_.reset();
    auto opened = open_sqlite_store({folder_.path(), most_bytes});
    ASSERT_TRUE(opened.ok()) << opened.status();
    store_ = *std::move(opened);
  }
  std::string damage(const std::string& file, std::string_view what) const {
    const std::string path = folder_.path() + "/" + file;
    std::ifstream in(path, std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(in)), {});
    const auto at = bytes.find(what);
    if (at != std::string::npos) bytes[at] = static_cast<char>(bytes[at] ^ 1);
    std::ofstream(path, std::ios::binary) << bytes;
    return at == std::string::npos ? "" : path;
  }

  Folder folder_;
  std::shared_ptr<Store> store_;
};

TEST_P(StoreTest, GivesBackWhatWasCommittedAfterItWasClosed) {
  ASSERT_EQ(*commit(*store_, beginning("a")), ChangeOutcome::kKept);
  const StoredChange next{.session = "a",
                          .epoch_before = 1,
                          .epoch = 1,
                          .parts = {{"inputs", "2"}, {"m:tip", std::nullopt}, {"p", "x"}}};
  ASSERT_EQ(*commit(*store_, next), ChangeOutcome::kKept);
  ASSERT_TRUE(store_->release({{"a", 1}}).ok());
  open();
  const auto found = store_->take_over("a", "anna");
  ASSERT_TRUE(found.ok()) << found.status();
  EXPECT_EQ(found->owner, "anna");
  EXPECT_EQ(found->parts, (std::map<std::string, std::string>{{"head", "h"}, {"inputs", "2"}, {"p", "x"}}));
}

TEST_P(StoreTest, ReplacesAllPartsWhereItIsToldTo) {
  ASSERT_TRUE(commit(*store_, beginning("a")).ok());
  const StoredChange all{
      .session = "a", .epoch_before = 1, .epoch = 1, .replaces_all = true, .parts = {{"head", "n"}}};
  ASSERT_EQ(*commit(*store_, all), ChangeOutcome::kKept);
  EXPECT_EQ(store_->take_over("a", "anna")->parts, (std::map<std::string, std::string>{{"head", "n"}}));
}

TEST_P(StoreTest, WhoeverTakesASessionOverFencesTheOneBeforeOff) {
  ASSERT_TRUE(commit(*store_, beginning("a")).ok());
  EXPECT_EQ(store_->take_over("a", "anna")->epoch, kSecondLife);
  const StoredChange old{.session = "a", .epoch_before = 1, .epoch = 1, .parts = {{"inputs", "old"}}};
  EXPECT_EQ(*commit(*store_, old), ChangeOutcome::kFenced);
  ASSERT_TRUE(commit(*store_, beginning("gone")).ok());
  ASSERT_TRUE(commit(*store_, {.session = "gone", .is_removal = true}).ok());
  const StoredChange removed{.session = "gone", .epoch_before = 1, .epoch = 1};
  EXPECT_EQ(*commit(*store_, removed), ChangeOutcome::kFenced);
  const auto found = store_->take_over("a", "anna");
  EXPECT_EQ(found->epoch, kSecondLife + kEpochsOfALife);
  EXPECT_EQ(found->parts.at("inputs"), "1");
}

TEST_P(StoreTest, FindsSessionsOfTheirOwnerOnly) {
  ASSERT_TRUE(commit(*store_, beginning("a")).ok());
  EXPECT_EQ(reason(store_->take_over("a", "bert").status()), "SESSION_UNKNOWN");
  EXPECT_EQ(reason(store_->take_over("b", "anna").status()), "SESSION_UNKNOWN");
  EXPECT_EQ(store_->take_over("a", "anna")->epoch, kSecondLife);  // looking was no taking over
}

TEST_P(StoreTest, ListsTheOwnersSessionsByName) {
  for (const char* name : {"c", "a", "d", "b"}) ASSERT_TRUE(commit(*store_, beginning(name)).ok());
  StoredChange other = beginning("ab");
  other.owner = "bert";
  ASSERT_TRUE(commit(*store_, other).ok());
  ASSERT_TRUE(commit(*store_, {.session = "c", .is_removal = true}).ok());
  using Names = std::vector<std::string>;
  EXPECT_EQ(*store_->list("anna", "", 10), (Names{"a", "b", "d"}));
  EXPECT_EQ(*store_->list("anna", "", 2), (Names{"a", "b"}));
  EXPECT_EQ(*store_->list("anna", "b", 2), Names{"d"});
  EXPECT_EQ(*store_->list("bert", "", 10), Names{"ab"});
  EXPECT_EQ(*store_->list("", "", 10), Names{});
}

TEST_P(StoreTest, FindsASessionByItsRequest) {
  StoredChange made = beginning("a");
  made.request_id = "request 1";
  ASSERT_TRUE(commit(*store_, made).ok());
  ASSERT_TRUE(commit(*store_, beginning("without a request")).ok());
  EXPECT_EQ(*store_->find_request("anna", "request 1"), "a");
  EXPECT_EQ(*store_->find_request("anna", "request 2"), "");
  EXPECT_EQ(*store_->find_request("bert", "request 1"), "");
  EXPECT_EQ(*store_->find_request("anna", ""), "");
}

TEST_P(StoreTest, ARemovedSessionIsGoneAndMayBeRemovedAgain) {
  ASSERT_TRUE(commit(*store_, beginning("a")).ok());
  const StoredChange removal{.session = "a", .is_removal = true};
  EXPECT_TRUE(commit(*store_, removal).ok());
  EXPECT_TRUE(commit(*store_, removal).ok());
  EXPECT_EQ(reason(store_->take_over("a", "anna").status()), "SESSION_UNKNOWN");
}

TEST_P(StoreTest, ABlobIsStoredOnceAndGoesWithItsLastSession) {
  const std::string bytes(1000, 'x'), key = blob_key(bytes);
  for (const std::string name : {"a", "b"}) {
    ASSERT_TRUE(store_->keep_blob(name, key, bytes).ok());
    StoredChange made = beginning(name);
    made.blobs = {key};
    ASSERT_TRUE(commit(*store_, made).ok());
  }
  if (!redis_) {
    EXPECT_EQ(folder_.blobs(), 1u);
  }
  ASSERT_TRUE(commit(*store_, {.session = "a", .is_removal = true}).ok());
  EXPECT_EQ(*store_->blob(key), bytes);
  ASSERT_TRUE(commit(*store_, {.session = "b", .is_removal = true}).ok());
  EXPECT_EQ(reason(store_->blob(key).status()), "SESSION_DAMAGED");
}

TEST_P(StoreTest, ABlobOfASessionThatIsBeingMadeOutlivesTheOthers) {
  const std::string bytes = "mesh", key = blob_key(bytes);
  ASSERT_TRUE(store_->keep_blob("a", key, bytes).ok());
  StoredChange made = beginning("a");
  made.blobs = {key};
  ASSERT_TRUE(commit(*store_, made).ok());
  ASSERT_TRUE(store_->keep_blob("b", key, bytes).ok());
  ASSERT_TRUE(commit(*store_, {.session = "a", .is_removal = true}).ok());
  EXPECT_TRUE(store_->blob(key).ok());
  ASSERT_TRUE(commit(*store_, {.session = "b", .is_removal = true}).ok());  // it was not made after all
  EXPECT_FALSE(store_->blob(key).ok());
}

TEST_F(SqliteStoreTest, ClearsAwayWhatAnEndBetweenBlobAndSessionLeft) {
  ASSERT_TRUE(store_->keep_blob("a", blob_key("mesh"), "mesh").ok());
  std::ofstream(folder_.path() + "/blobs/abc.unfinished7") << "half";
  EXPECT_EQ(folder_.blobs(), 2u);
  open();
  EXPECT_EQ(folder_.blobs(), 0u);
}

TEST_F(SqliteStoreTest, RemovesWhatNobodyHasUsed) {
  ASSERT_TRUE(commit(*store_, beginning("a")).ok());
  EXPECT_EQ(*store_->remove_unused(60'000), 0u);
  const std::vector<TouchedSession> sessions{{"a", 1, true}};
  EXPECT_TRUE(store_->touch(sessions)->lost.empty());
  EXPECT_EQ(*store_->remove_unused(-1000), 1u);  // as a second later
  EXPECT_FALSE(store_->take_over("a", "anna").ok());
}

TEST_F(SqliteStoreTest, ItsFolderIsForOneServer) {
  const auto second = open_sqlite_store({folder_.path()});
  EXPECT_TRUE(absl::IsUnavailable(second.status()));
  EXPECT_EQ(reason(second.status()), "STORE_FAILING");
  EXPECT_TRUE(commit(*store_, beginning("a")).ok());
}

TEST_F(SqliteStoreTest, CallsNothingKeptInAFolderThatWasRemoved) {
  ASSERT_TRUE(commit(*store_, beginning("a")).ok());
  std::filesystem::remove_all(folder_.path());
  const auto refused = commit(*store_, beginning("b"));
  EXPECT_EQ(fault_of(refused.status()).reason, "STORE_FAILING");
  EXPECT_TRUE(absl::StrContains(text_for_operators(refused.status()), folder_.path())) << refused.status();
  EXPECT_FALSE(absl::StrContains(refused.status().message(), folder_.path())) << refused.status();
}

TEST_F(SqliteStoreTest, FindsAChangedBitInAPartAndInABlob) {
  const std::string bytes = "a mesh that the disk will change", key = blob_key(bytes);
  ASSERT_TRUE(store_->keep_blob("a", key, bytes).ok());
  StoredChange made = beginning("a");
  made.blobs = {key};
  made.parts["p"] = "a part that the disk will change";
  ASSERT_TRUE(commit(*store_, made).ok());
  ASSERT_TRUE(commit(*store_, beginning("b")).ok());
  store_.reset();
  ASSERT_NE(damage("sessions.db", "a part that"), "");
  ASSERT_NE(damage("blobs/" + key, "a mesh that"), "");
  open();
  EXPECT_EQ(reason(store_->take_over("a", "anna").status()), "SESSION_DAMAGED");
  EXPECT_EQ(reason(store_->blob(key).status()), "SESSION_DAMAGED");
  EXPECT_TRUE(store_->take_over("b", "anna").ok());
}

TEST_F(SqliteStoreTest, RefusesADatabaseThatIsNone) {
  store_.reset();
  std::ofstream(folder_.path() + "/sessions.db") << std::string(8192, 'x');
  const auto opened = open_sqlite_store({folder_.path()});
  EXPECT_EQ(reason(opened.status()), "STORE_FAILING");
  EXPECT_NE(text_for_operators(opened.status()).find(folder_.path()), std::string::npos) << opened.status();
  EXPECT_EQ(std::filesystem::file_size(folder_.path() + "/sessions.db"), 8192u);
}

TEST_F(SqliteStoreTest, AFullStoreChangesNothingAndGoesOnWhenThereIsRoom) {
  open(200'000);
  ASSERT_TRUE(commit(*store_, beginning("a")).ok());
  const StoredChange large{.session = "a",
                           .epoch_before = 1,
                           .epoch = 1,
                           .parts = {{"inputs", "2"}, {"p", std::string(300'000, 'p')}}};
  EXPECT_EQ(reason(commit(*store_, large).status()), "STORE_FULL");
  const std::string mesh(300'000, 'm');
  EXPECT_EQ(reason(store_->keep_blob("b", blob_key(mesh), mesh)), "STORE_FULL");
  EXPECT_EQ(folder_.blobs(), 0u);
  const StoredChange small{.session = "a", .epoch_before = 1, .epoch = 1, .parts = {{"m:tip", "there"}}};
  EXPECT_TRUE(commit(*store_, small).ok());
  open(2'000'000);
  EXPECT_EQ(store_->take_over("a", "anna")->parts,
            (std::map<std::string, std::string>{{"head", "h"}, {"inputs", "1"}, {"m:tip", "there"}}));
}

class RedisStoreTest : public testing::Test {
 protected:
  /// A store as one of several servers has it.
  std::shared_ptr<Store> open(std::chrono::milliseconds lease = std::chrono::minutes(1),
                              std::chrono::milliseconds stays = std::chrono::seconds(1),
                              std::chrono::milliseconds patience = std::chrono::seconds(30)) {
    auto opened = open_redis_store(
        {.host = "127.0.0.1", .port = redis_.port(), .lease = lease, .stays = stays, .patience = patience});
    EXPECT_TRUE(opened.ok()) << opened.status();
    return *std::move(opened);
  }

  Folder folder_;
  RedisServer redis_{folder_.path()};
};

TEST_F(RedisStoreTest, ASessionInUseIsHeldUntilItIsLetGo) {
  const auto first = open(), second = open();
  ASSERT_TRUE(commit(*first, beginning("a")).ok());
  EXPECT_EQ(reason(second->take_over("a", "anna").status()), "SESSION_ELSEWHERE");
  EXPECT_TRUE(absl::IsUnavailable(second->take_over("a", "anna").status()));
  ASSERT_TRUE(second->release({{"a", 1}}).ok());  // it is not the second's to release
  EXPECT_FALSE(second->take_over("a", "anna").ok());
  ASSERT_TRUE(first->release({{"a", 1}}).ok());
  EXPECT_EQ(second->take_over("a", "anna")->epoch, kSecondLife);
}

TEST_F(RedisStoreTest, WhoIsRefusedLearnsTheWayAndWhoComesThatWayIsGivenIt) {
  constexpr std::chrono::minutes kMinute{1};
  const auto first = open(kMinute, kMinute), second = open(kMinute, kMinute);  // however slow this machine is
  StoredChange change = beginning("a");
  change.route = "the way";
  ASSERT_TRUE(commit(*first, change).ok());
  const std::vector<TouchedSession> sessions{{"a", 1, true, 0}};
  const auto is_wanted = [&] { return !first->touch(sessions)->wanted.empty(); };
  const auto ask = [&](const std::string& route) { return second->take_over("a", "anna", route).status(); };
  EXPECT_EQ(fault_of(ask("another")).limit, "lpdeform-session: the way");
  EXPECT_FALSE(is_wanted());
  EXPECT_EQ(reason(second->take_over("a", "bert", "the way").status()), "SESSION_UNKNOWN");
  EXPECT_FALSE(is_wanted());
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  bool was_wanted = false;
  do {
    EXPECT_EQ(reason(ask("the way")), "SESSION_ELSEWHERE");
    was_wanted = is_wanted();
  } while (!was_wanted && std::chrono::steady_clock::now() < end);
  EXPECT_TRUE(was_wanted);
  ASSERT_TRUE(first->release({{"a", 1}}).ok());
  const auto taken = second->take_over("a", "anna", "the way");
  ASSERT_TRUE(taken.ok());
  EXPECT_EQ(taken->route, "the way");
  const std::vector<TouchedSession> there{{"a", 2, true, 0}};
  EXPECT_TRUE(second->touch(there)->wanted.empty());
  EXPECT_EQ(reason(first->take_over("a", "anna", "the way").status()), "SESSION_ELSEWHERE");
  EXPECT_TRUE(second->touch(there)->wanted.empty());  // it has just come
}

/// A session in Redis whose times a test sets, so that it need not wait for them.
class HandOverTest : public RedisStoreTest {
 protected:
  HandOverTest() {
    StoredChange change = beginning("a");
    change.route = "the way";
    EXPECT_EQ(*commit(*first_, change), ChangeOutcome::kKept);
  }

  /// As if this moment had been so many milliseconds ago; negative: as if it came then.
  void set_ago(const std::string& field, std::int64_t ms, const std::string& key = "lpdeform:s:a") {
    const auto time = redis().run({"TIME"});
    std::int64_t seconds = 0, microseconds = 0;
    ASSERT_TRUE(time.ok() && absl::SimpleAtoi(time->elements.at(0).text, &seconds) &&
                absl::SimpleAtoi(time->elements.at(1).text, &microseconds));
    const std::string moment = absl::StrCat(1000 * seconds + microseconds / 1000 - ms);
    ASSERT_TRUE(redis().run({"HSET", key, field, moment}).ok());
  }
  RedisConnection& redis() { return connection_; }

  static std::string ask(Store& store, const std::string& route) {
    return reason(store.take_over("a", "anna", route).status());
  }
  static bool is_wanted(Store& store, bool is_being_made = false) {
    const std::vector<TouchedSession> sessions{{"a", 1, true, 0, is_being_made}};
    return !store.touch(sessions)->wanted.empty();
  }

  std::shared_ptr<Store> open_one() { return open(kLong, std::chrono::milliseconds(kStays)); }

  static constexpr std::int64_t kStays = 100'000, kAges = 100 * kStays;  // longer than any test takes
  static constexpr std::chrono::hours kLong{1};
  std::shared_ptr<Store> first_ = open_one(), second_ = open_one(), third_ = open_one();
  RedisConnection connection_{"127.0.0.1", redis_.port(), std::chrono::seconds(5)};
};

TEST_F(HandOverTest, AMisroutedCallerIsShownTheWayAsLongAsTheHolderLives) {
  set_ago("until", kAges);  // nobody uses it
  EXPECT_EQ(ask(*second_, "another way"), "SESSION_ELSEWHERE");
  EXPECT_EQ(fault_of(second_->take_over("a", "anna", "another way").status()).limit,
            "lpdeform-session: the way");
  EXPECT_EQ(fault_of(second_->take_over("a", "anna").status()).limit, "lpdeform-session: the way");
  EXPECT_FALSE(is_wanted(*first_));
  set_ago("until", kAges);
  set_ago("alive", kAges);
  EXPECT_EQ(ask(*second_, "another way"), "");
  set_ago("until", kAges);
  EXPECT_EQ(ask(*third_, "the way"), "");  // who comes as they should need not wait for that
  set_ago("until", kAges);
  set_ago("alive", kAges);
  EXPECT_EQ(ask(*second_, ""), "");  // nor, once the holder is dead, who says none
  EXPECT_FALSE(is_wanted(*second_));
}

TEST_F(HandOverTest, OneThatIsBeingMadeIsHeldAndStays) {
  ASSERT_EQ(ask(*first_, "the way"), "");
  set_ago("until", kAges);
  set_ago("alive", kAges);
  set_ago("since", kAges);  // it takes long
  EXPECT_FALSE(is_wanted(*first_, true));
  EXPECT_EQ(ask(*second_, "the way"), "SESSION_ELSEWHERE");
  EXPECT_FALSE(is_wanted(*first_));
}

/// What holds when no server has reached Redis for some time. A lease lasts an hour here.
class OutageTest : public HandOverTest {
 protected:
  static constexpr std::int64_t kMinute = 60'000;

  OutageTest() { EXPECT_TRUE(second_->touch({}).ok()); }
  void reached_ago(std::int64_t minutes) { set_ago("at", minutes * kMinute, "lpdeform:time"); }
  void back_ago(std::int64_t minutes) { set_ago("back", minutes * kMinute, "lpdeform:time"); }
  void tick() { ASSERT_TRUE(second_->touch({}).ok()); }
  /// As if so many minutes had passed.
  void pass(std::int64_t minutes) {
    for (const char* const field : {"at", "away", "back", "first"}) shift("lpdeform:time", field, minutes);
    for (const char* const field : {"until", "alive", "since"}) shift("lpdeform:s:a", field, minutes);
  }
  void shift(const std::string& key, const std::string& field, std::int64_t minutes) {
    ASSERT_TRUE(redis().run({"HINCRBY", key, field, absl::StrCat(-minutes * kMinute)}).ok());
  }
  void lease_ended_ago(std::int64_t minutes) {
    set_ago("until", minutes * kMinute);
    set_ago("alive", minutes * kMinute);
  }
};

TEST_F(OutageTest, ALeaseThatEndsMeanwhileHoldsUntilItsHolderHadTimeToRenewIt) {
  lease_ended_ago(10);
  reached_ago(50);
  EXPECT_EQ(ask(*second_, "the way"), "SESSION_ELSEWHERE");
  EXPECT_EQ(ask(*second_, "another way"), "SESSION_ELSEWHERE");
  tick();
  EXPECT_EQ(ask(*second_, "the way"), "SESSION_ELSEWHERE");
  EXPECT_EQ(ask(*second_, "another way"), "SESSION_ELSEWHERE");
  back_ago(55);
  EXPECT_EQ(ask(*second_, "another way"), "SESSION_ELSEWHERE");
  back_ago(61);
  EXPECT_EQ(ask(*second_, "another way"), "");
}

TEST_F(OutageTest, ALeaseThatEndedBeforeHasEnded) {
  reached_ago(50);
  lease_ended_ago(51);
  EXPECT_EQ(ask(*second_, "the way"), "");
}

TEST_F(OutageTest, AServerThatIsLateAloneHoldsNothing) {
  lease_ended_ago(10);
  reached_ago(29);  // by another one
  EXPECT_EQ(ask(*second_, "the way"), "");
}

TEST_F(OutageTest, ASecondSoonAfterTheFirstContinuesIt) {
  lease_ended_ago(-30);
  pass(50);
  tick();
  pass(50);
  EXPECT_EQ(ask(*second_, "the way"), "SESSION_ELSEWHERE");
  tick();
  EXPECT_EQ(ask(*second_, "the way"), "SESSION_ELSEWHERE");
}

/// Redis is slow all the time, and the holder of the session is dead.
TEST_F(OutageTest, OutagesWithoutEndHoldNoLeaseForEver) {
  lease_ended_ago(-30);
  int outages = 0;
  for (; ask(*second_, "the way") != ""; ++outages) {
    ASSERT_LT(outages, 10);
    pass(50);
    tick();
  }
  EXPECT_GE(outages, 3);
}

TEST_F(OutageTest, AHolderWhoseConnectionWasLostMeanwhileHasTimeToConnect) {
  pass(50);
  first_.reset();
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (redis().run({"PUBSUB", "CHANNELS", "lpdeform:h:*"})->elements.size() > 2)
    ASSERT_LT(std::chrono::steady_clock::now(), end);
  EXPECT_EQ(ask(*second_, "another way"), "SESSION_ELSEWHERE");
  tick();
  EXPECT_EQ(ask(*second_, "another way"), "SESSION_ELSEWHERE");
  back_ago(61);
  EXPECT_EQ(ask(*second_, "another way"), "");
}

TEST_F(OutageTest, AClockThatIsSetBackTakesNoLeaseAway) {
  pass(50);
  tick();
  pass(-600);
  lease_ended_ago(-30);
  EXPECT_EQ(ask(*second_, "another way"), "SESSION_ELSEWHERE");
  pass(50);
  tick();
  lease_ended_ago(-30);
  EXPECT_EQ(ask(*second_, "another way"), "SESSION_ELSEWHERE");
  pass(120);
  tick();
  lease_ended_ago(10);
  EXPECT_EQ(ask(*second_, "another way"), "SESSION_ELSEWHERE");
  back_ago(61);
  EXPECT_EQ(ask(*second_, "another way"), "");
}

TEST_F(HandOverTest, WhoWantedItIsGivenItFirst) {
  EXPECT_EQ(ask(*second_, "the way"), "SESSION_ELSEWHERE");
  set_ago("wanted", -kAges);  // however slow this machine is
  EXPECT_TRUE(is_wanted(*first_));
  EXPECT_EQ(ask(*third_, "the way"), "SESSION_ELSEWHERE");
  ASSERT_TRUE(first_->release({{"a", 1}}).ok());
  EXPECT_EQ(ask(*first_, "the way"), "SESSION_ELSEWHERE");
  EXPECT_EQ(ask(*third_, ""), "SESSION_ELSEWHERE");
  EXPECT_EQ(ask(*second_, "the way"), "");
}

TEST_F(HandOverTest, WhoWantedItAndIsGoneHoldsNobodyUp) {
  EXPECT_EQ(ask(*second_, "the way"), "SESSION_ELSEWHERE");
  ASSERT_TRUE(first_->release({{"a", 1}}).ok());
  set_ago("wanted", kAges);
  EXPECT_EQ(ask(*third_, "the way"), "");
}

TEST_F(HandOverTest, WhoWantedItAndHasEndedHoldsNobodyUp) {
  EXPECT_EQ(ask(*second_, "the way"), "SESSION_ELSEWHERE");
  set_ago("wanted", -kAges);
  ASSERT_TRUE(first_->release({{"a", 1}}).ok());
  EXPECT_EQ(ask(*third_, "the way"), "SESSION_ELSEWHERE");
  second_.reset();
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (ask(*third_, "the way") != "") ASSERT_LT(std::chrono::steady_clock::now(), end);
}

TEST_F(HandOverTest, TwoThatWantItInTurnGetItLessAndLessOften) {
  const std::shared_ptr<Store> both[] = {first_, second_};
  std::uint64_t epoch = 1;
  for (std::int64_t stays = kStays, turn = 0; turn < 8; ++turn, stays = std::min(2 * stays, 32 * kStays)) {
    Store &has = *both[turn % 2], &wants = *both[1 - turn % 2];
    if (turn == 0) set_ago("since", stays + kAges);
    if (turn > 0) {
      set_ago("since", stays / 2);
      EXPECT_EQ(ask(wants, "the way"), "SESSION_ELSEWHERE");
      EXPECT_FALSE(is_wanted(has)) << stays;
      set_ago("since", 2 * stays);
    }
    EXPECT_EQ(ask(wants, "the way"), "SESSION_ELSEWHERE");
    set_ago("wanted", -kAges);
    EXPECT_TRUE(is_wanted(has)) << stays;
    ASSERT_TRUE(has.release({{"a", epoch}}).ok());
    if (turn == 0) stays /= 2;  // it had been there for long
    const auto taken = wants.take_over("a", "anna", "the way");
    ASSERT_TRUE(taken.ok()) << taken.status();
    epoch = taken->epoch;
  }
}

TEST_F(HandOverTest, LettingGoOfAnEarlierEpochIsTooLate) {
  ASSERT_EQ(ask(*first_, "the way"), "");
  ASSERT_TRUE(first_->release({{"a", 1}}).ok());  // of the epoch before
  EXPECT_EQ(ask(*second_, "the way"), "SESSION_ELSEWHERE");
  ASSERT_TRUE(first_->release({{"a", kSecondLife}}).ok());
  const std::vector<TouchedSession> late{{"a", kSecondLife, true}};
  EXPECT_EQ(first_->touch(late)->lost, std::vector<std::string>{"a"});
  EXPECT_EQ(ask(*second_, "the way"), "");
}

TEST_F(HandOverTest, WhatHasExpiredForTheHolderBeforeIsNotRemoved) {
  ASSERT_TRUE(first_->release({{"a", 1}}).ok());
  ASSERT_EQ(ask(*second_, "the way"), "");
  const StoredChange expiry{
      .session = "a", .epoch_before = kSecondLife + kEpochsOfALife, .is_removal = true, .is_expiry = true};
  EXPECT_EQ(*commit(*first_, expiry), ChangeOutcome::kFenced);
  EXPECT_EQ(ask(*second_, "the way"), "");
  EXPECT_EQ(*commit(*second_, expiry), ChangeOutcome::kKept);
  EXPECT_EQ(ask(*second_, "the way"), "SESSION_UNKNOWN");
  EXPECT_EQ(*commit(*second_, expiry), ChangeOutcome::kKept);  // its answer may have been lost
}

TEST_F(RedisStoreTest, ALeaseThatNobodyRenewsEndsAndItsHolderIsFencedOff) {
  const auto first = open(std::chrono::milliseconds(1)), second = open();
  ASSERT_TRUE(commit(*first, beginning("a")).ok());
  absl::StatusOr<StoredSession> taken;
  do {
    taken = second->take_over("a", "anna");
  } while (reason(taken.status()) == "SESSION_ELSEWHERE");
  ASSERT_TRUE(taken.ok());
  for (const std::uint64_t epoch :
       {std::uint64_t{1}, kSecondLife}) {  // also where it makes up the same next epoch
    const StoredChange late{.session = "a", .epoch_before = 1, .epoch = epoch, .parts = {{"inputs", "late"}}};
    EXPECT_EQ(*commit(*first, late), ChangeOutcome::kFenced);
  }
  const std::vector<TouchedSession> sessions{{"a", 1, true}};
  EXPECT_EQ(first->touch(sessions)->lost, std::vector<std::string>{"a"});
  const std::vector<TouchedSession> held{{"a", kSecondLife, true}};
  EXPECT_TRUE(second->touch(held)->lost.empty());
  EXPECT_EQ(second->take_over("a", "anna")->parts.at("inputs"), "1");
}

TEST_F(RedisStoreTest, WhatAServerHeldThatHasEndedIsFreeBeforeItsLeaseEnds) {
  auto first = open();
  const auto second = open();
  StoredChange change = beginning("a");
  change.route = "the way";
  ASSERT_TRUE(commit(*first, change).ok());
  EXPECT_EQ(reason(second->take_over("a", "anna", "the way").status()), "SESSION_ELSEWHERE");
  first.reset();  // without a release
  absl::StatusOr<StoredSession> taken;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  do taken = second->take_over("a", "anna", "another way");
  while (reason(taken.status()) == "SESSION_ELSEWHERE" && std::chrono::steady_clock::now() < end);
  EXPECT_TRUE(taken.ok()) << taken.status();
}

TEST_F(RedisStoreTest, WhoIsNotSeenForAMomentIsSeenAgainAndOneWhoMayNotListenIsHeldByTheLease) {
  RedisConnection redis("127.0.0.1", redis_.port(), std::chrono::seconds(5));
  const auto first = open(), second = open();
  ASSERT_TRUE(commit(*first, beginning("a")).ok());
  ASSERT_TRUE(redis.run({"CLIENT", "KILL", "TYPE", "pubsub"}).ok());
  const std::vector<TouchedSession> sessions{{"a", 1, true}};
  while (!first->touch(sessions).ok()) {  // once to see that the connection is gone
  }
  EXPECT_EQ(reason(second->take_over("a", "anna").status()), "SESSION_ELSEWHERE");
  ASSERT_TRUE(redis.run({"ACL", "SETUSER", "default", "-subscribe", "-pubsub"}).ok());
  const auto unseen = open();
  ASSERT_TRUE(commit(*unseen, beginning("b")).ok());
  EXPECT_TRUE(unseen->touch(std::vector<TouchedSession>{{"b", 1, true}})->lost.empty());
  EXPECT_EQ(reason(second->take_over("b", "anna").status()), "SESSION_ELSEWHERE");
}

TEST_F(RedisStoreTest, AChangeWhoseAnswerWasLostCanBeMadeAgain) {
  const auto store = open();
  ASSERT_TRUE(commit(*store, beginning("a")).ok());
  const StoredChange writer{.session = "a", .epoch_before = 1, .epoch = 2, .parts = {{"writer", "w"}}};
  EXPECT_EQ(*commit(*store, writer), ChangeOutcome::kKept);
  EXPECT_EQ(*commit(*store, writer), ChangeOutcome::kKept);
  EXPECT_EQ(*commit(*store, beginning("a")), ChangeOutcome::kKept);
}

TEST_F(RedisStoreTest, RedisAwaySlowOrRestartedIsAnErrorThatPasses) {
  const std::chrono::milliseconds a_minute = std::chrono::minutes(1), little = std::chrono::seconds(1);
  const auto store = open(), hasty = open(a_minute, a_minute, little);
  ASSERT_TRUE(commit(*store, beginning("a")).ok());
  redis_.pause();
  EXPECT_EQ(reason(hasty->take_over("a", "anna").status()), "STORE_FAILING");
  redis_.resume();
  const auto end = std::chrono::steady_clock::now() + a_minute;
  while (reason(hasty->take_over("a", "anna").status()) == "STORE_FAILING")
    ASSERT_LT(std::chrono::steady_clock::now(), end);
  redis_.stop();
  EXPECT_EQ(reason(commit(*store, beginning("b")).status()), "STORE_FAILING");
  EXPECT_EQ(reason(store->blob("key").status()), "STORE_FAILING");
  redis_.start();
  EXPECT_TRUE(commit(*store, beginning("b")).ok());
  EXPECT_EQ(store->take_over("a", "anna")->parts.at("inputs"), "1");
}

TEST_F(RedisStoreTest, ARedisThatHangsIsNotWaitedForOnceTheProcessEnds) {
  constexpr std::chrono::seconds kPatience{30};
  const auto store = *open_redis_store({.host = "127.0.0.1", .port = redis_.port(), .patience = kPatience});
  ASSERT_TRUE(commit(*store, beginning("a")).ok());
  redis_.pause();
  std::thread ending([&] { store->end_by(std::chrono::steady_clock::now()); });
  ending.join();
  const auto begin = std::chrono::steady_clock::now();
  const auto refused = commit(*store, beginning("b"));
  EXPECT_TRUE(is_away(refused.status()));
  EXPECT_EQ(reason(refused.status()), "STORE_FAILING");
  EXPECT_TRUE(is_away(store->touch({}).status()));
  EXPECT_TRUE(is_away(store->release({{"a", 1}})));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, kPatience);
  redis_.resume();
}

TEST_F(RedisStoreTest, ARedisThatWentBackIsTold) {
  const auto store = open();
  StoredChange first = beginning("a");
  first.revision = 1;
  ASSERT_EQ(*commit(*store, first), ChangeOutcome::kKept);
  const std::string saved = folder_.path() + "/saved";
  redis_.save_as(saved);
  StoredChange next{.session = "a",
                    .epoch_before = 1,
                    .epoch = 1,
                    .revision_before = 1,
                    .revision = 2,
                    .parts = {{"m:tip", "there"}}};
  ASSERT_EQ(*commit(*store, next), ChangeOutcome::kKept);
  ASSERT_EQ(*commit(*store, next), ChangeOutcome::kKept);  // again: its answer may have been lost
  const std::vector<TouchedSession> sessions{{"a", 1, true, 2}};
  EXPECT_TRUE(store->touch(sessions)->behind.empty());
  redis_.stop();
  redis_.go_back_to(saved);
  redis_.start();
  while (!store->touch(sessions).ok()) {  // once to see that the connection is gone
  }
  EXPECT_EQ(store->touch(sessions)->behind, std::vector<std::string>{"a"});
  StoredChange later{.session = "a",
                     .epoch_before = 1,
                     .epoch = 1,
                     .revision_before = 2,
                     .revision = 3,
                     .parts = {{"inputs", "3"}}};
  absl::StatusOr<ChangeOutcome> outcome;
  do outcome = commit(*store, later);
  while (!outcome.ok());
  EXPECT_EQ(*outcome, ChangeOutcome::kBehind);
  EXPECT_EQ(store->touch(sessions)->behind, std::vector<std::string>{"a"});  // nothing was changed
  later.replaces_all = true;
  later.parts = {{"head", "h"}, {"inputs", "3"}, {"m:tip", "there"}};
  EXPECT_EQ(*commit(*store, later), ChangeOutcome::kKept);
  EXPECT_TRUE(store->touch(sessions)->behind.empty());
  const auto other = store->take_over("a", "anna");
  ASSERT_TRUE(other.ok());
  EXPECT_EQ(other->parts.at("m:tip"), "there");
  next.epoch_before = next.epoch = other->epoch;  // a process that counts from the start
  next.revision_before = 5;
  EXPECT_EQ(*commit(*store, next), ChangeOutcome::kKept);
}

/// Of Redis's own commands.
class RedisKeys {
 public:
  explicit RedisKeys(int port) : redis_("127.0.0.1", port, std::chrono::seconds(5)) {}
  RedisReply run(const RedisConnection::Command& command) {
    const auto reply = redis_.run(command);
    EXPECT_TRUE(reply.ok()) << reply.status();
    return reply.ok() ? *reply : RedisReply();
  }
  std::set<std::string> all() {
    std::set<std::string> names;
    for (const RedisReply& name : run({"KEYS", "*"}).elements) names.insert(name.text);
    return names;
  }

 private:
  RedisConnection redis_;
};

constexpr std::int64_t kIdle = 600'000;
const std::string kIdleText = "600000";
const std::vector<TouchedSession> kNone;

TEST_F(RedisStoreTest, WhatNobodyHasUsedWhileServersRanGoesAndLeavesNothing) {
  const auto store = open(), other = open();
  RedisKeys redis(redis_.port());
  ASSERT_TRUE(store->touch(kNone).ok());
  const std::string mesh = "mesh", key = blob_key(mesh), unused = blob_key("unused");
  for (const std::string name : {"a", "z"}) {
    ASSERT_TRUE(store->keep_blob(name, key, mesh).ok());
    StoredChange made = beginning(name);
    made.blobs = {key};
    made.request_id = name;
    ASSERT_TRUE(commit(*store, made).ok());
  }
  ASSERT_TRUE(store->keep_blob("never made", unused, "unused").ok());
  redis.run({"HINCRBY", "lpdeform:time", "ran", kIdleText});
  const std::vector<TouchedSession> used{{"z", 1, true, 0}};
  ASSERT_TRUE(store->touch(used).ok());
  EXPECT_EQ(*other->remove_unused(kIdle), 2u);
  EXPECT_EQ(*store->list("anna", "", 10), std::vector<std::string>{"z"});
  EXPECT_EQ(*store->find_request("anna", "a"), "");
  EXPECT_EQ(*store->blob(key), mesh);
  EXPECT_FALSE(store->blob(unused).ok());
  redis.run({"HINCRBY", "lpdeform:time", "ran", kIdleText});
  EXPECT_EQ(*other->remove_unused(kIdle), 1u);
  EXPECT_EQ(redis.all(), (std::set<std::string>{"lpdeform:time", "lpdeform:gone", "lpdeform:gone:epochs"}));
  EXPECT_EQ(redis.run({"ZCARD", "lpdeform:gone"}).number, 3);
}

TEST_F(RedisStoreTest, TheTimeThatRedisWasAwayOrNoServerRanDoesNotCountAsWithoutUse) {
  const auto store = open();
  RedisKeys redis(redis_.port());
  StoredChange made = beginning("a");
  made.request_id = "request";
  const std::string key = blob_key("mesh");
  ASSERT_TRUE(store->keep_blob("a", key, "mesh").ok());
  ASSERT_TRUE(store->touch(kNone).ok());
  made.blobs = {key};
  ASSERT_TRUE(commit(*store, made).ok());
  redis.run(
      {"HINCRBY", "lpdeform:time", "at", "-" + kIdleText});  // as if all since then had been such a time
  redis.run({"HINCRBY", "lpdeform:time", "at", "-" + kIdleText});
  ASSERT_TRUE(store->touch(kNone).ok());
  EXPECT_EQ(*store->remove_unused(kIdle), 0u);
  for (const std::string& name : redis.all()) EXPECT_EQ(redis.run({"TTL", name}).number, -1) << name;
  EXPECT_EQ(*store->find_request("anna", "request"), "a");
  EXPECT_EQ(*store->blob(key), "mesh");
  ASSERT_TRUE(store->release({{"a", 1}}).ok());
  EXPECT_EQ(open()->take_over("a", "anna")->epoch, kSecondLife);
}

StoredChange next_of(const StoredChange& made) {
  StoredChange next = made;
  next.epoch_before = next.epoch;
  next.revision_before = made.revision;
  next.revision = made.revision + 1;
  next.parts = {{"inputs", "2"}};
  return next;
}

StoredChange recreated(const StoredChange& change) {
  StoredChange all = change;
  all.parts = {{"head", "h"}, {"inputs", "2"}, {"m:tip", "there"}};
  all.replaces_all = all.is_recreated = true;
  return all;
}

TEST_F(RedisStoreTest, WhatRedisHasLostIsToldAndWrittenAgainByItsHolder) {
  const auto store = open(), other = open();
  RedisKeys redis(redis_.port());
  StoredChange made = beginning("a");
  made.revision = 1;
  made.request_id = "request";
  made.route = "way";
  ASSERT_TRUE(commit(*store, made).ok());
  const std::vector<TouchedSession> used{{"a", 1, true, 1}};
  redis.run({"FLUSHALL"});
  EXPECT_EQ(store->touch(used)->missing, std::vector<std::string>{"a"});
  const StoredChange next = next_of(made);
  EXPECT_EQ(*commit(*store, next), ChangeOutcome::kLost);
  EXPECT_FALSE(store->take_over("a", "anna").ok());
  EXPECT_EQ(*commit(*store, recreated(next)), ChangeOutcome::kKept);
  EXPECT_EQ(*commit(*store, recreated(next)), ChangeOutcome::kKept);  // again: its answer may have been lost
  EXPECT_TRUE(store->touch(used)->missing.empty());
  EXPECT_EQ(*store->find_request("anna", "request"), "a");
  EXPECT_EQ(*store->list("anna", "", 10), std::vector<std::string>{"a"});
  EXPECT_EQ(reason(other->take_over("a", "anna", "elsewhere").status()), "SESSION_ELSEWHERE");
  ASSERT_TRUE(store->release({{"a", 1}}).ok());
  const auto taken = other->take_over("a", "anna");
  ASSERT_TRUE(taken.ok()) << taken.status();
  EXPECT_EQ(taken->route, "way");
  EXPECT_EQ(taken->parts.at("m:tip"), "there");
}

TEST_F(RedisStoreTest, ABlobThatRedisHasLostIsToldAndTheOneInItsPlaceIsKept) {
  const auto store = open();
  RedisKeys redis(redis_.port());
  const std::string old = blob_key("old"), fresh = blob_key("fresh"), same = blob_key("same");
  StoredChange made = beginning("a");
  made.blobs = {old, same};
  ASSERT_TRUE(store->keep_blob("a", old, "old").ok() && store->keep_blob("a", same, "same").ok());
  ASSERT_TRUE(commit(*store, made).ok());
  const std::vector<TouchedSession> used{{"a", 1, true, 0}};
  EXPECT_TRUE(store->touch(used)->missing.empty());
  redis.run({"DEL", "lpdeform:b:" + old});
  EXPECT_EQ(store->touch(used)->missing, std::vector<std::string>{"a"});
  StoredChange all = recreated(next_of(made));
  all.blobs = {fresh, same};
  ASSERT_TRUE(store->keep_blob("a", fresh, "fresh").ok() && store->keep_blob("a", same, "same").ok());
  EXPECT_EQ(*commit(*store, all), ChangeOutcome::kKept);
  EXPECT_TRUE(store->touch(used)->missing.empty());
  EXPECT_EQ(*store->blob(same), "same");
  EXPECT_FALSE(redis.all().contains("lpdeform:u:" + old));
  ASSERT_TRUE(commit(*store, {.session = "a", .is_removal = true}).ok());
  EXPECT_FALSE(store->blob(fresh).ok());
  EXPECT_FALSE(store->blob(same).ok());
}

TEST_F(RedisStoreTest, WhatWasRemovedIsNotWrittenAgainByWhoDidNotKnow) {
  const auto store = open(std::chrono::milliseconds(1)), other = open();
  const StoredChange made = beginning("a");
  ASSERT_TRUE(commit(*store, made).ok());
  absl::StatusOr<StoredSession> taken;
  do taken = other->take_over("a", "anna");
  while (!taken.ok());
  ASSERT_TRUE(commit(*other, {.session = "a", .is_removal = true}).ok());
  const std::vector<TouchedSession> used{{"a", 1, true, 0}};
  EXPECT_EQ(store->touch(used)->lost, std::vector<std::string>{"a"});
  EXPECT_EQ(*commit(*store, recreated(next_of(made))), ChangeOutcome::kFenced);
  EXPECT_FALSE(other->take_over("a", "anna").ok());
}

TEST_F(RedisStoreTest, OfThoseThatWereRemovedOnlyTheLastAreRemembered) {
  RedisKeys redis(redis_.port());
  const auto cut_off = open(std::chrono::milliseconds(1));
  const auto other = *open_redis_store({.host = "127.0.0.1", .port = redis_.port(), .most_gone = 10});
  const auto pass = [&] {
    redis.run({"HINCRBY", "lpdeform:time", "ran", "1000"});
    ASSERT_TRUE(other->touch({}).ok());
  };
  const auto go = [&](const std::string& name) {
    ASSERT_TRUE(commit(*other, beginning(name)).ok());
    ASSERT_TRUE(commit(*other, {.session = name, .is_removal = true}).ok());
  };
  const StoredChange made = beginning("a");
  ASSERT_TRUE(commit(*cut_off, made).ok());
  pass();
  ASSERT_TRUE(commit(*other, {.session = "a", .is_removal = true}).ok());
  pass();
  for (int k = 0; k < 100; ++k) go(absl::StrCat("another", k));
  EXPECT_EQ(redis.run({"ZCARD", "lpdeform:gone"}).number, 10);
  EXPECT_EQ(redis.run({"ZSCORE", "lpdeform:gone", "a"}).text, "");  // nothing knows of its end
  EXPECT_EQ(*commit(*cut_off, recreated(next_of(made))), ChangeOutcome::kFenced);
  const std::vector<TouchedSession> used{{"a", 1, true, 0}};
  EXPECT_EQ(cut_off->touch(used)->lost, std::vector<std::string>{"a"});

  const StoredChange live = beginning("live");  // of one that was told since
  ASSERT_TRUE(commit(*cut_off, live).ok());
  pass();
  for (int k = 0; k < 2; ++k) EXPECT_TRUE(cut_off->touch({}).ok());
  redis.run({"DEL", "lpdeform:s:live"});
  const std::vector<TouchedSession> lost{{"live", 1, true, 0}};
  EXPECT_EQ(cut_off->touch(lost)->missing, std::vector<std::string>{"live"});
  EXPECT_EQ(*commit(*cut_off, recreated(next_of(live))), ChangeOutcome::kKept);
}

TEST_F(RedisStoreTest, WhatExpiresForOneThatHadItBeforeStaysWithTheOneThatHasIt) {
  RedisKeys redis(redis_.port());
  const auto before = open(std::chrono::milliseconds(1)), now = open();
  const StoredChange made = beginning("a");
  ASSERT_TRUE(commit(*before, made).ok());
  absl::StatusOr<StoredSession> taken;
  do taken = now->take_over("a", "anna");
  while (!taken.ok());
  const StoredChange expiry{.session = "a", .epoch_before = 1, .is_removal = true, .is_expiry = true};
  EXPECT_EQ(*commit(*before, expiry), ChangeOutcome::kFenced);
  const std::vector<TouchedSession> used{{"a", kSecondLife, true, 0}};
  EXPECT_TRUE(now->touch(used)->lost.empty());
  EXPECT_EQ(*commit(*now, expiry), ChangeOutcome::kFenced);  // it has it again, in a later epoch
  redis.run({"FLUSHALL"});
  EXPECT_TRUE(commit(*before, expiry).ok());
  EXPECT_EQ(now->touch(used)->missing, std::vector<std::string>{"a"});
  StoredChange next = next_of(made);
  next.epoch_before = next.epoch = kSecondLife;
  EXPECT_EQ(*commit(*now, recreated(next)), ChangeOutcome::kKept);
}

TEST_F(RedisStoreTest, WhatWasRemovedAsUnusedIsWrittenAgainOnlyByWhoHadItLast) {
  RedisKeys redis(redis_.port());
  const std::chrono::milliseconds lease(100);
  const auto cut_off = open(lease), other = open(lease);
  const std::vector<TouchedSession> used{{"a", 1, true, 0}};
  const StoredChange made = beginning("a");
  const auto go_unused = [&] {
    ASSERT_TRUE(other->touch(kNone).ok());
    redis.run({"HINCRBY", "lpdeform:time", "ran", kIdleText});
    EXPECT_EQ(*other->remove_unused(kIdle), 1u);
  };
  ASSERT_TRUE(commit(*cut_off, made).ok());
  go_unused();  // while the server that has it in use is cut off
  EXPECT_EQ(cut_off->touch(used)->missing, std::vector<std::string>{"a"});
  EXPECT_EQ(*commit(*cut_off, recreated(next_of(made))), ChangeOutcome::kKept);
  absl::StatusOr<StoredSession> taken;
  const auto end = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  do {
    ASSERT_TRUE(other->touch(kNone).ok());
    taken = other->take_over("a", "anna");
    ASSERT_LT(std::chrono::steady_clock::now(), end);
  } while (!taken.ok());
  go_unused();
  EXPECT_EQ(cut_off->touch(used)->lost, std::vector<std::string>{"a"});
  EXPECT_EQ(*commit(*cut_off, recreated(next_of(made))), ChangeOutcome::kFenced);
}

TEST_F(RedisStoreTest, AHolderOfALaterEpochWinsOverARedisThatWentBack) {
  const auto first = open(std::chrono::milliseconds(1)), second = open();
  const StoredChange made = beginning("a");
  ASSERT_TRUE(commit(*first, made).ok());
  redis_.save_as(folder_.path() + "/saved");
  absl::StatusOr<StoredSession> taken;
  do taken = second->take_over("a", "anna");
  while (!taken.ok());
  redis_.stop();
  redis_.go_back_to(folder_.path() + "/saved");
  redis_.start();
  const std::vector<TouchedSession> before{{"a", 1, true, 0}}, after{{"a", kSecondLife, true, 0}};
  while (!second->touch(kNone).ok()) {  // once to see that the connection is gone
  }
  EXPECT_EQ(second->touch(after)->missing, std::vector<std::string>{"a"});
  StoredChange next = next_of(made);
  next.epoch_before = next.epoch = kSecondLife;
  absl::StatusOr<ChangeOutcome> outcome;
  do outcome = commit(*second, recreated(next));
  while (!outcome.ok());
  EXPECT_EQ(*outcome, ChangeOutcome::kKept);
  while (!first->touch(kNone).ok()) {
  }
  EXPECT_EQ(first->touch(before)->lost, std::vector<std::string>{"a"});
}

TEST_F(RedisStoreTest, AFullRedisTakesNothingNewAndStillLetsGo) {
  const auto store = open();
  RedisKeys redis(redis_.port());
  ASSERT_TRUE(store->touch(kNone).ok());
  ASSERT_TRUE(commit(*store, beginning("a")).ok());
  ASSERT_TRUE(commit(*store, beginning("b")).ok());
  redis.run({"CONFIG", "SET", "maxmemory", "1"});
  const absl::Status refused = commit(*store, beginning("c")).status();
  EXPECT_EQ(reason(refused), "STORE_FULL");
  EXPECT_NE(refused.message().find("OOM"), std::string::npos) << refused;
  const std::vector<TouchedSession> used{{"a", 1, true, 0}};
  EXPECT_TRUE(store->touch(used).ok());
  ASSERT_TRUE(store->release({{"a", 1}}).ok());
  EXPECT_TRUE(store->take_over("a", "anna").ok());
  ASSERT_TRUE(commit(*store, {.session = "a", .is_removal = true}).ok());
  redis.run({"CONFIG", "SET", "maxmemory", "0"});
  redis.run({"HINCRBY", "lpdeform:time", "ran", kIdleText});
  redis.run({"CONFIG", "SET", "maxmemory", "1"});
  EXPECT_EQ(*store->remove_unused(kIdle), 1u);
  EXPECT_TRUE(store->list("anna", "", 10)->empty());
}

TEST_F(RedisStoreTest, APasswordIsReadWithEachConnectionAndInNoText) {
  RedisKeys redis(redis_.port());
  const std::string file = folder_.path() + "/password";
  const auto write = [&](const std::string& password) { std::ofstream(file) << password << "\n"; };
  const auto open_as = [&](const std::string& user) {
    return open_redis_store({.host = "127.0.0.1", .port = redis_.port(), .login = {user, file}});
  };
  EXPECT_NE(open_as("anna").status().message().find(file), std::string::npos);  // there is none yet
  redis.run({"ACL", "SETUSER", "anna", "on", ">first secret", "~*", "&*", "+@all"});
  redis.run({"CONFIG", "SET", "requirepass", "second secret"});
  const auto unknown = open_redis_store({.host = "127.0.0.1", .port = redis_.port()});
  EXPECT_EQ(reason(unknown.status()), "STORE_FAILING");
  EXPECT_NE(unknown.status().message().find("NOAUTH"), std::string::npos) << unknown.status();
  write("first secret");
  const auto store = open_as("anna");
  ASSERT_TRUE(store.ok()) << store.status();
  const absl::Status refused = open_as("").status();
  EXPECT_EQ(reason(refused), "STORE_FAILING");
  EXPECT_EQ(refused.message().find("secret"), std::string::npos) << refused;
  write("second secret");
  EXPECT_TRUE(open_as("").ok());
  redis.run({"ACL", "SETUSER", "anna", "resetpass", ">third secret"});
  redis.run({"CLIENT", "KILL", "USER", "anna"});
  EXPECT_FALSE((*store)->touch(kNone).ok());
  write("third secret");
  while (!(*store)->touch(kNone).ok()) {  // once to see that the connection is gone
  }
  EXPECT_TRUE(commit(**store, beginning("a")).ok());
}

TEST_F(RedisStoreTest, AUserOfItsOwnNeedsItsKeysAndItsChannelsAndNothingDangerous) {
  RedisKeys redis(redis_.port());
  redis.run(
      {"ACL", "SETUSER", "lpdeform", "on", ">secret", "~lpdeform:*", "&lpdeform:*", "+@all", "-@dangerous"});
  std::ofstream(folder_.path() + "/password") << "secret\n";
  const auto open_as_user = [&] {
    auto opened = open_redis_store({.host = "127.0.0.1",
                                    .port = redis_.port(),
                                    .login = {"lpdeform", folder_.path() + "/password"},
                                    .lease = std::chrono::minutes(1)});
    EXPECT_TRUE(opened.ok()) << opened.status();
    return *std::move(opened);
  };
  auto store = open_as_user();
  StoredChange made = beginning("a");
  made.request_id = "request";
  made.blobs = {blob_key("mesh")};
  ASSERT_TRUE(store->keep_blob("a", made.blobs[0], "mesh").ok());
  ASSERT_EQ(*commit(*store, made), ChangeOutcome::kKept);
  EXPECT_TRUE(store->touch(std::vector<TouchedSession>{{"a", 1, true}})->lost.empty());
  EXPECT_EQ(*store->find_request("anna", "request"), "a");
  EXPECT_EQ(store->list("anna", "", 10)->size(), 1u);
  EXPECT_EQ(*store->remove_unused(kIdle), 0u);
  const auto other = open_as_user();
  EXPECT_EQ(reason(other->take_over("a", "anna").status()), "SESSION_ELSEWHERE");
  store.reset();  // its end is seen
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  while (!other->take_over("a", "anna").ok()) ASSERT_LT(std::chrono::steady_clock::now(), end);
  EXPECT_TRUE(commit(*other, {.session = "a", .is_removal = true}).ok());
}

TEST(OpenRedisStore, RefusesAServerThatIsNotThere) {
  const auto opened = open_redis_store({.host = "127.0.0.1", .port = 1});
  EXPECT_EQ(reason(opened.status()), "STORE_FAILING");
}

TEST(OpenSqliteStore, RefusesAFolderThatCannotBeMade) {
  Folder folder;
  std::ofstream(folder.path() + "/file") << "no folder";
  const auto opened = open_sqlite_store({folder.path() + "/file/store"});
  EXPECT_EQ(reason(opened.status()), "STORE_FAILING");
}

}  // namespace
}  // namespace lpdeform
