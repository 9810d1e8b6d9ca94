#include "server/runtime/machine_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <string>

namespace lpdeform {
namespace {

constexpr auto kNone = std::numeric_limits<std::uint64_t>::max();

/// What a kernel shows in /proc/self/cgroup and /sys/fs/cgroup, made in a folder.
class ControlGroups : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string made = ::testing::TempDir() + "groupsXXXXXX";
    ASSERT_NE(mkdtemp(made.data()), nullptr);
    folder_ = made;
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& path, const std::string& text) {
    std::filesystem::create_directories((folder_ / path).parent_path());
    std::ofstream(folder_ / path) << text << '\n';
  }
  std::uint64_t least() const { return least_limit_of_groups(folder_ / "membership", folder_ / "tree"); }

  std::filesystem::path folder_;
};

TEST_F(ControlGroups, AServiceHasTheLimitOfItsOwnGroup) {
  write("membership", "0::/system.slice/lpdeform.service");
  write("tree/system.slice/lpdeform.service/memory.max", "1073741824");
  write("tree/system.slice/memory.max", "max");
  EXPECT_EQ(least(), 1u << 30);
}

TEST_F(ControlGroups, AndThatOfAnyGroupAboveWhereItIsLess) {
  write("membership", "0::/all.slice/some.slice/lpdeform.service");
  write("tree/all.slice/some.slice/lpdeform.service/memory.max", "3000");
  write("tree/all.slice/some.slice/memory.max", "max");
  write("tree/all.slice/memory.max", "2000");
  EXPECT_EQ(least(), 2000u);
}

TEST_F(ControlGroups, AContainerSeesItsOwnAsTheRoot) {
  write("tree/memory.max", "4096");
  write("membership", "0::/");
  EXPECT_EQ(least(), 4096u);
  write("membership", "0::/docker/0123");  // where it sees the path outside, too
  EXPECT_EQ(least(), 4096u);
}

TEST_F(ControlGroups, TheFirstVersionHasATreeOfMemory) {
  write("membership", "12:cpu,cpuacct:/jobs\n11:hugetlb,memory:/jobs/one\n1:name=systemd:/a:b\n0::/jobs");
  write("tree/memory/jobs/one/memory.limit_in_bytes", "9223372036854771712");  // none
  write("tree/memory/jobs/memory.limit_in_bytes", "5000");
  write("tree/memory/memory.limit_in_bytes", "9223372036854771712");
  EXPECT_EQ(least(), 5000u);
}

TEST_F(ControlGroups, WithoutAnyThereIsNoLimit) {
  EXPECT_EQ(least(), kNone);
  write("membership", "not as it should be\n0::/a");
  write("tree/a/memory.max", "max");
  EXPECT_EQ(least(), kNone);
}

TEST(MachineMemory, IsThatOfTheMachineAtMost) {
  const auto pages = static_cast<std::size_t>(sysconf(_SC_PHYS_PAGES));
  EXPECT_GT(memory_of_process(), std::size_t{16} << 20);
  EXPECT_LE(memory_of_process(), pages * static_cast<std::size_t>(sysconf(_SC_PAGE_SIZE)));
}

}  // namespace
}  // namespace lpdeform
