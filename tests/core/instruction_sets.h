#pragma once

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace lpdeform {

/// The sets that this processor has, the best first, for hwy::SetSupportedTargetsForTest.
inline std::vector<std::int64_t> instruction_sets() {
  std::vector<std::int64_t> result;
  for (std::int64_t rest = hwy::SupportedTargets(); rest != 0; rest &= rest - 1)
    result.push_back(rest & -rest);
  return result;
}

/// For x86 and Arm sets whose vectors have a fixed width; 0 for others, whose width depends on the processor.
inline int vector_bits(std::int64_t set) {
  const std::string name = hwy::TargetName(set);
  if (name.starts_with("AVX3") || name.starts_with("AVX10")) return 512;
  if (name == "AVX2") return 256;
  return name.starts_with("SSE") || name.starts_with("SSSE") || name.starts_with("NEON") ? 128 : 0;
}

/// The best set of each width that this processor has, by bits.
inline std::map<int, std::int64_t> best_of_each_width() {
  std::map<int, std::int64_t> result;
  for (const std::int64_t set : instruction_sets()) result.try_emplace(vector_bits(set), set);
  return result;
}

}  // namespace lpdeform
