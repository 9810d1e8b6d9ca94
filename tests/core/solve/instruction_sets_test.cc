#include "tests/core/instruction_sets.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

constexpr double kTolerance = 1e-9;
constexpr double kDiagonal = 21.7;  // of the bar

/// The twisted bar, solved with one instruction set.
struct Result {
  Points positions;
  double energy = 0;
};

Result solved(double p, std::int64_t instruction_set) {
  hwy::SetSupportedTargetsForTest(instruction_set);
  const TriangleMesh bar = box_surface(4, 4, 21);
  auto solver = deformer(rest_shape(bar), bar_twist(bar), Material::uniform(p));
  SolveSettings settings;
  settings.tolerance = kTolerance;
  const SolveSummary summary = solver->solve(settings).value();
  hwy::SetSupportedTargetsForTest(0);
  return {solver->positions(), summary.energy};
}

// What core/README.md says of other processors. Sums are rounded in another order; a solve ends where the energy changes by less than
// its tolerance, so that energies within that are the same to it, and near a minimum positions differ by the root of what energies do.
TEST(InstructionSets, EndAtTheSameShape) {
  for (const double p : {1.5, 2.0, 6.0}) {
    const Result best = solved(p, instruction_sets().front());
    for (const std::int64_t set : instruction_sets()) {
      const Result other = solved(p, set);
      EXPECT_LT(std::abs(other.energy / best.energy - 1), kTolerance)
          << hwy::TargetName(set) << ", p = " << p;
      EXPECT_LT((other.positions - best.positions).rowwise().norm().maxCoeff(),
                std::sqrt(kTolerance) * kDiagonal)
          << hwy::TargetName(set) << ", p = " << p;
    }
  }
}

}  // namespace
}  // namespace lpdeform
