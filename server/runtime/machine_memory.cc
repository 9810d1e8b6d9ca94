#include "server/runtime/machine_memory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace lpdeform {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::uint64_t>::max();

std::uint64_t limit_in(const std::string& path) {
  std::uint64_t limit = 0;
  return std::ifstream(path) >> limit && limit > 0 ? limit : kNoLimit;  // "max" is not a number
}

/// The least limit of the group at `path` ("/a/b") and of all groups above it, up to the root.
std::uint64_t least_limit_from(const std::string& root, std::string path, const char* file) {
  while (!path.empty() && path.back() == '/') path.pop_back();
  std::uint64_t least = limit_in(absl::StrCat(root, path, "/", file));
  if (const auto above = path.rfind('/'); above != std::string::npos) {
    least = std::min(least, least_limit_from(root, path.substr(0, above), file));
  }
  return least;
}

bool has_memory(const std::string& controllers) {
  const std::vector<std::string> names = absl::StrSplit(controllers, ',');
  return std::find(names.begin(), names.end(), "memory") != names.end();
}

}  // namespace

std::uint64_t least_limit_of_groups(const std::string& membership, const std::string& hierarchy) {
  std::uint64_t least = kNoLimit;
  std::ifstream groups(membership);
  for (std::string line; std::getline(groups, line);) {
    const std::vector<std::string> parts =
        absl::StrSplit(line, absl::MaxSplits(':', 2));  // number, controllers, path
    if (parts.size() != 3) continue;
    if (parts[1].empty()) {
      least = std::min(least, least_limit_from(hierarchy, parts[2], "memory.max"));
    } else if (has_memory(parts[1])) {
      least = std::min(least, least_limit_from(hierarchy + "/memory", parts[2], "memory.limit_in_bytes"));
    }
  }
  return least;
}

std::size_t memory_of_process() {
  const auto machine = static_cast<std::uint64_t>(sysconf(_SC_PHYS_PAGES)) *
                       static_cast<std::uint64_t>(sysconf(_SC_PAGE_SIZE));
  return static_cast<std::size_t>(
      std::min(machine, least_limit_of_groups("/proc/self/cgroup", "/sys/fs/cgroup")));
}

}  // namespace lpdeform
