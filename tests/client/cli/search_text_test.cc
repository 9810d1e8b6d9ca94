// The second line of `lpdeform deform`: each sentence is true of every solve that can lead to it.

#include "client/cli/search_text.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace lpdeform::cli {
namespace {

using client::StopReason;

/// A solve with this effort that has found the first minimum, and then these.
client::SolveResult searched(std::uint32_t effort, std::uint32_t starts, std::vector<double> further = {}) {
  client::SolveResult result;
  result.stop_reason = StopReason::kConverged;
  result.effort = effort;
  result.further_starts = starts;
  result.search_iterations = 20 * starts;
  result.minima = {8};
  result.minima.insert(result.minima.end(), further.begin(), further.end());
  return result;
}

TEST(SearchText, CountsTheStartsThatEndedInAMinimumAndTheEnergiesThatDiffer) {
  EXPECT_EQ(search_text(searched(1, 8, {8.004, 7, 7.001, 7.5})),
            "looked for lower minima from 8 further starts, of which 4 ended in a minimum; minima of 3 "
            "energies were "
            "seen, E "
            "from 7 to 8.004");
  EXPECT_EQ(
      search_text(searched(1, 8)),
      "looked for lower minima from 8 further starts, of which 0 ended in a minimum; minima of 1 energy were "
      "seen, E = 8");
}

TEST(SearchText, DoesNotSayWhereASingleStartLooked) {
  // It is the result of coarse levels, or the only one of a small mesh before a limit.
  EXPECT_EQ(search_text(searched(1, 1, {7})),
            "looked for lower minima from 1 further start, of which 1 ended in a minimum; minima of 2 "
            "energies were seen, "
            "E from 7 to "
            "8");
  EXPECT_EQ(search_text(searched(1, 1)),
            "looked for lower minima from 1 further start, of which 0 ended in a minimum; minima of 1 energy "
            "were seen, "
            "E = 8");
}

TEST(SearchText, GivesNoReasonWhyThereWasNoSearch) {
  // The mesh may be small or without distortion, a limit may have passed, or a factorisation may have failed.
  EXPECT_EQ(search_text(searched(0, 0)), "no other minima were looked for (effort 0)");
  EXPECT_EQ(search_text(searched(4, 0)), "no other minima were looked for (effort 4)");
}

TEST(SearchText, SaysThatNoStartHasEndedYet) {
  client::SolveResult cut_off = searched(1, 0);
  cut_off.search_iterations = 3;
  EXPECT_EQ(search_text(cut_off), "the search for lower minima ended before its first start did");
}

TEST(SearchText, TellsAServerWithoutASearchFromASolveWithoutAMinimum) {
  client::SolveResult result;
  for (const StopReason reason : {StopReason::kConverged, StopReason::kStalled}) {
    result.stop_reason = reason;
    EXPECT_EQ(search_text(result), "the server does not say whether it looked for other minima");
  }
  for (const StopReason reason :
       {StopReason::kIterationLimit, StopReason::kTimeLimit, StopReason::kNumericalBreakdown}) {
    result.stop_reason = reason;
    EXPECT_EQ(search_text(result), "the solve ended before a first minimum, and no other was looked for");
  }
}

TEST(SearchText, CountsEnergiesByTheNextLowerOne) {
  EXPECT_EQ(different_energies({}), 0U);
  EXPECT_EQ(different_energies({2, 1, 2, 1}), 2U);
  EXPECT_EQ(different_energies({1.0009, 1, 1.0018}), 1U);
  EXPECT_EQ(different_energies({1, 1.0011}), 2U);
}

}  // namespace
}  // namespace lpdeform::cli
