// An SQLite store on a full disk, simulated: what it refuses, what it still does, and that it recovers by itself.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/base/fault.h"
#include "full_disk.h"
#include "server/store/sqlite_store.h"

namespace lpdeform {
namespace {

std::string reason(const absl::Status& status) {
  return fault_of(status).reason;
}

class FullStoreTest : public testing::Test {
 protected:
  FullStoreTest() {
    char name[] = "/tmp/lpdeform-full-XXXXXX";
    folder_ = mkdtemp(name);
  }
  ~FullStoreTest() override {
    store_.reset();
    std::filesystem::remove_all(folder_);
  }
  void SetUp() override { open(); }
  void open(std::uint64_t most_bytes = 0) {
    store_.reset();
    auto opened = open_sqlite_store({folder_, most_bytes});
    ASSERT_TRUE(opened.ok()) << opened.status();
    store_ = *std::move(opened);
  }

  absl::Status change(const StoredChange& change) { return store_->commit({&change, 1}).status(); }
  /// A session with a part of so many bytes.
  absl::Status make(const std::string& name, std::size_t bytes) {
    return change({.session = name,
                   .epoch = 1,
                   .owner = "anna",
                   .parts = {{"head", "h"}, {"p", std::string(bytes, 'p')}}});
  }
  absl::Status set(const std::string& name, const std::string& part, const std::string& value) {
    return change({.session = name, .epoch_before = 1, .epoch = 1, .parts = {{part, value}}});
  }
  absl::Status remove(const std::string& name) { return change({.session = name, .is_removal = true}); }
  /// Sessions until the store refuses one; how many it took.
  int fill(std::size_t bytes) {
    for (int k = 0;; ++k) {
      const absl::Status made = make(absl::StrCat("s", k), bytes);
      if (made.ok()) continue;
      EXPECT_EQ(reason(made), "STORE_FULL") << made;
      EXPECT_TRUE(absl::IsResourceExhausted(made));
      return k;
    }
  }
  std::uintmax_t size_of(const std::string& file) const {
    return std::filesystem::file_size(folder_ + "/" + file);
  }
  static unsigned mode_of(const std::string& path) {
    struct stat about = {};
    return stat(path.c_str(), &about) == 0 ? about.st_mode & 0777U : 0;
  }

  FullDisk disk_;
  std::string folder_;
  std::shared_ptr<Store> store_;
};

TEST_F(FullStoreTest, RemovesAndTakesAgainWithoutARestart) {
  for (int k = 0; k < 20; ++k) ASSERT_TRUE(make(absl::StrCat("old", k), 300'000).ok());
  disk_.set_full(true);
  const int more = fill(300'000);
  EXPECT_TRUE(store_->room()->is_full ||
              store_->room()->free_bytes > 300'000);  // the real disk may have room
  for (int k = 0; k < 20; ++k) EXPECT_TRUE(remove(absl::StrCat("old", k)).ok());
  EXPECT_EQ(reason(store_->take_over("old3", "anna").status()), "SESSION_UNKNOWN");
  for (int k = 0; k < 10; ++k) EXPECT_TRUE(make(absl::StrCat("new", k), 300'000).ok()) << k;
  for (int k = 0; k < more; ++k) EXPECT_TRUE(store_->take_over(absl::StrCat("s", k), "anna").ok());
  EXPECT_EQ(store_->take_over("new7", "anna")->parts.at("p"), std::string(300'000, 'p'));
}

TEST_F(FullStoreTest, WhatNeedsNoMoreRoomIsKept) {
  ASSERT_TRUE(make("a", 1000).ok());
  ASSERT_TRUE(set("a", "m:tip", "0000").ok());
  disk_.set_full(true);
  fill(100'000);
  // Many times what the log takes: each commit is two pages of it at least.
  for (int k = 1000; k < 4000; ++k) ASSERT_TRUE(set("a", "m:tip", absl::StrCat(k)).ok()) << k;
  const std::vector<TouchedSession> touched{{"a", 1, true}};
  EXPECT_TRUE(store_->touch(touched).ok());
  EXPECT_EQ(store_->take_over("a", "anna")->parts.at("m:tip"), "3999");
}

TEST_F(FullStoreTest, WhatIsRefusedLeavesNothing) {
  ASSERT_TRUE(make("a", 1000).ok());
  disk_.set_full(true);
  EXPECT_EQ(reason(set("a", "stiffness", std::string(40 << 20, 'x'))), "STORE_FULL");
  EXPECT_EQ(reason(make("b", 40 << 20)), "STORE_FULL");
  EXPECT_EQ(reason(store_->take_over("b", "anna").status()), "SESSION_UNKNOWN");
  EXPECT_FALSE(store_->take_over("a", "anna")->parts.contains("stiffness"));
  disk_.set_full(false);
  EXPECT_TRUE(make("b", 40 << 20).ok());
}

TEST_F(FullStoreTest, WhatNobodyUsesStillGoes) {
  for (int k = 0; k < 50; ++k) ASSERT_TRUE(make(absl::StrCat("old", k), 100'000).ok());
  disk_.set_full(true);
  fill(100'000);
  EXPECT_GE(*store_->remove_unused(-1000), 50u);  // as a second later
  EXPECT_TRUE(make("new", 2'000'000).ok());
}

TEST_F(FullStoreTest, ASessionOfManyPartsGoesThoughTheyAreAllOverTheFile) {
  constexpr int kParts = 6000, kSessions = 4;
  for (int k = 0; k < kSessions; ++k) ASSERT_TRUE(make(absl::StrCat("a", k), 100).ok());
  for (int from = 0; from < kParts; from += 500) {
    for (int k = 0; k < kSessions; ++k) {
      StoredChange parts{.session = absl::StrCat("a", k), .epoch_before = 1, .epoch = 1};
      for (int part = from; part < from + 500; ++part)
        parts.parts[absl::StrCat("g:", part)] = std::string(3000, 'g');
      ASSERT_TRUE(change(parts).ok());
    }
  }
  disk_.set_full(true);
  fill(100'000);
  EXPECT_TRUE(remove("a1").ok());
  EXPECT_TRUE(remove("a2").ok());
  for (int k = 0; k < 8; ++k) EXPECT_TRUE(make(absl::StrCat("b", k), 3'000'000).ok()) << k;
  EXPECT_EQ(store_->take_over("a3", "anna")->parts.size(), kParts + 2u);
}

TEST_F(FullStoreTest, AServerThatBeginsOnAFullDiskRemoves) {
  for (int k = 0; k < 20; ++k) ASSERT_TRUE(make(absl::StrCat("old", k), 300'000).ok());
  disk_.set_full(true);
  fill(300'000);
  open();
  EXPECT_GE(size_of("sessions.db-wal"), std::uintmax_t{16} << 20);  // it was left where it was
  EXPECT_TRUE(remove("old7").ok());
  EXPECT_TRUE(make("new", 200'000).ok());
  EXPECT_TRUE(store_->take_over("old8", "anna").ok());
}

TEST_F(FullStoreTest, AServerThatHasNoRoomToStartSaysHowMuchItTakesAndWhere) {
  ASSERT_TRUE(make("a", 1000).ok());
  store_.reset();
  std::filesystem::remove(folder_ + "/sessions.db-wal");
  disk_.set_full(true);
  const auto refused = open_sqlite_store({folder_});
  EXPECT_EQ(reason(refused.status()), "STORE_FULL");
  const std::string text(refused.status().message());
  EXPECT_NE(
      text.find("Make 20 MiB of room on the disk of " + folder_ + ": the server cannot start until then."),
      std::string::npos)
      << text;
  EXPECT_EQ(text.find("Delete sessions"), std::string::npos) << text;
  disk_.set_full(false);
  open();
}

TEST_F(FullStoreTest, TheDiskGetsBackWhatALargeSessionTook) {
  ASSERT_TRUE(make("large", 60 << 20).ok());
  const std::uintmax_t before = size_of("sessions.db");
  ASSERT_TRUE(remove("large").ok());
  for (int k = 0; k < 200; ++k) {  // some pages with each
    ASSERT_TRUE(make("a", 1000).ok());
    ASSERT_TRUE(remove("a").ok());
  }
  open();
  EXPECT_LT(size_of("sessions.db"), before / 4);
}

TEST_F(FullStoreTest, WhatALogThatIsLeftHasInItIsNoPartOfAnotherDatabase) {
  ASSERT_TRUE(make("a", 1000).ok());
  store_.reset();
  std::filesystem::copy_file(folder_ + "/sessions.db", folder_ + "/backup");
  open();
  ASSERT_TRUE(make("b", 1000).ok());
  store_.reset();
  std::filesystem::rename(folder_ + "/backup", folder_ + "/sessions.db");
  open();
  EXPECT_TRUE(store_->take_over("a", "anna").ok());
  EXPECT_EQ(reason(store_->take_over("b", "anna").status()), "SESSION_UNKNOWN");
}

TEST_F(FullStoreTest, ALimitSaysWhatItIsAndRoomUnderItComesBack) {
  open(4'000'000);
  const std::string mesh(1'500'000, 'm'), other(1'500'000, 'n');
  ASSERT_TRUE(store_->keep_blob("a", blob_key(mesh), mesh).ok());
  ASSERT_TRUE(
      change(
          {.session = "a", .epoch = 1, .owner = "anna", .blobs = {blob_key(mesh)}, .parts = {{"head", "h"}}})
          .ok());
  ASSERT_TRUE(make("b", 1'500'000).ok());
  const absl::Status refused = store_->keep_blob("c", blob_key(other), other);
  EXPECT_EQ(reason(refused), "STORE_FULL");
  EXPECT_EQ(fault_of(refused).limit, "bytes <= 4000000");
  EXPECT_TRUE(store_->room()->is_full);
  ASSERT_TRUE(remove("b").ok());  // its pages are for blobs now
  EXPECT_FALSE(store_->room()->is_full);
  EXPECT_TRUE(store_->keep_blob("c", blob_key(other), other).ok());
}

TEST_F(FullStoreTest, NobodyElseMayReadItsFilesNewOrOld) {
  ASSERT_TRUE(make("a", 1000).ok());
  ASSERT_TRUE(store_->keep_blob("a", blob_key("mesh"), "mesh").ok());
  const auto expect_private = [&] {
    for (const char* file : {"sessions.db", "sessions.db-wal"})
      EXPECT_EQ(mode_of(folder_ + "/" + file), 0600U) << file;
    EXPECT_EQ(mode_of(folder_ + "/blobs/" + blob_key("mesh")), 0600U);
    EXPECT_EQ(mode_of(folder_ + "/blobs"), 0700U);
  };
  expect_private();
  StoredChange with_blob{
      .session = "b", .epoch = 1, .owner = "anna", .blobs = {blob_key("mesh")}, .parts = {{"head", "h"}}};
  ASSERT_TRUE(change(with_blob).ok());
  store_.reset();
  for (const char* file : {"sessions.db", "sessions.db-wal"}) chmod((folder_ + "/" + file).c_str(), 0644);
  chmod((folder_ + "/blobs").c_str(), 0755);
  open();
  expect_private();
  const auto fresh = open_sqlite_store({folder_ + "/a/new/folder"});
  ASSERT_TRUE(fresh.ok());
  EXPECT_EQ(mode_of(folder_ + "/a/new/folder"), 0700U);
}

}  // namespace
}  // namespace lpdeform
