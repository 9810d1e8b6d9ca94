// Linked into test programs of the core: selects the instruction set that LPDEFORM_INSTRUCTION_SET names, instead of the
// processor's best.

#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/core/instruction_sets.h"

namespace lpdeform {
namespace {

class WithInstructionSet : public testing::Environment {
 public:
  void SetUp() override {
    const char* name = std::getenv("LPDEFORM_INSTRUCTION_SET");
    if (name == nullptr) return;
    for (const std::int64_t set : instruction_sets()) {
      if (name != std::string(hwy::TargetName(set))) continue;
      hwy::SetSupportedTargetsForTest(set);
      return;
    }
    FAIL() << "this processor has no " << name;
  }
};

const auto* const environment = testing::AddGlobalTestEnvironment(new WithInstructionSet);

}  // namespace
}  // namespace lpdeform
