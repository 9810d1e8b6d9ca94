// Writes a CTest test for each vector width of this processor except the widest, which the tests use anyway:
//   list_vector_widths PROGRAM PREFIX FILE
// PROGRAM runs its tests with the instruction set that LPDEFORM_INSTRUCTION_SET names, except tests that go through all sets
// by themselves, and tests of led drags, levels, searches and locked sides. Those use large meshes, take most of the time, and have no
// vector code that the other tests do not run.

#include <fstream>

#include "tests/core/instruction_sets.h"

constexpr char kLeftOut[] =
    "Targets/*:InstructionSets.*:*LedDrag*:GentleMove*:Multiresolution*:MinimaSearch*:SideLocks.*";

int main(int count, char** words) {
  if (count != 4) return 2;
  const std::string program = words[1], prefix = words[2];
  std::ofstream file(words[3]);
  for (const auto& [bits, set] : lpdeform::best_of_each_width()) {
    if (bits == 0 || set == lpdeform::instruction_sets().front()) continue;
    const std::string name = prefix + ".With" + std::to_string(bits) + "BitVectors";
    file << "add_test(\"" << name << "\" \"" << program << "\" --gtest_brief=1 --gtest_filter=-" << kLeftOut
         << ")\n"
         << "set_tests_properties(\"" << name
         << "\" PROPERTIES ENVIRONMENT LPDEFORM_INSTRUCTION_SET=" << hwy::TargetName(set)
         << " LABELS slow TIMEOUT 1800)\n";
  }
  return file.good() ? 0 : 1;
}
