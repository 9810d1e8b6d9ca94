#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace lpdeform {

/// The bytes of memory that this process may have: the machine's, or what its control group (v2 or v1) or one above it may have,
/// where that is less.
std::size_t memory_of_process();

/// The least limit, in bytes, of the groups that `membership` names and of all above them; the largest number where none has one.
/// `membership`: a file as /proc/self/cgroup. `hierarchy`: a folder as /sys/fs/cgroup. A container sees its own group as the root of
/// it, under whatever path: files that are not there limit nothing.
std::uint64_t least_limit_of_groups(const std::string& membership, const std::string& hierarchy);

}  // namespace lpdeform
