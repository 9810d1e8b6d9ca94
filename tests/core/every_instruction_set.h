#pragma once

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <cstdint>
#include <string>

#include "tests/core/instruction_sets.h"

namespace lpdeform {

/// A fixture whose kernels run in one instruction set, for testing::ValuesIn(instruction_sets()) and by_its_name.
class EveryInstructionSet : public testing::TestWithParam<std::int64_t> {
 protected:
  EveryInstructionSet() { hwy::SetSupportedTargetsForTest(GetParam()); }
  ~EveryInstructionSet() override { hwy::SetSupportedTargetsForTest(0); }
};

inline std::string by_its_name(const testing::TestParamInfo<std::int64_t>& info) {
  return hwy::TargetName(info.param);
}

}  // namespace lpdeform
