#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace lpdeform {

/// Bytes of memory that this process may use: the memory of the machine, or the limit of its control group
/// (v2 or v1) or of one above it if that is less.
std::size_t memory_of_process();

/// The least limit, in bytes, of the groups that `membership` names and of all groups above them; the largest
/// number if none has a limit. `membership`: a file like /proc/self/cgroup. `hierarchy`: a folder like
/// /sys/fs/cgroup. A container sees its own group as the root of the hierarchy, whatever its path is. Files
/// that do not exist limit nothing.
std::uint64_t least_limit_of_groups(const std::string& membership, const std::string& hierarchy);

}  // namespace lpdeform
