#pragma once

#include <hwy/highway.h>

#include <cstdint>
#include <vector>

namespace lpdeform {

/// Those that this processor has, for hwy::SetSupportedTargetsForTest.
inline std::vector<std::int64_t> instruction_sets() {
  std::vector<std::int64_t> result;
  for (std::int64_t rest = hwy::SupportedTargets(); rest != 0; rest &= rest - 1)
    result.push_back(rest & -rest);
  return result;
}

}  // namespace lpdeform
