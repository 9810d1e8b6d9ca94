#include "client/cli/search_text.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace lpdeform::cli {
namespace {

constexpr double kSameEnergy = 1e-3;  // relative; well over the tolerance of solves

std::string without_minimum(client::StopReason reason) {
  // A server that is older than the search tells no minima, even if it has reached one.
  const bool has_reached_one =
      reason == client::StopReason::kConverged || reason == client::StopReason::kStalled;
  return has_reached_one ? "the server does not say whether it looked for other minima"
                         : "the solve ended before a first minimum, and no other was looked for";
}

std::string starts_text(const client::SolveResult& result) {
  return absl::StrFormat("%u further start%s, of which %u ended in a minimum", result.further_starts,
                         result.further_starts == 1 ? "" : "s", result.minima.size() - 1);
}

std::string energies_text(const std::vector<double>& minima) {
  const auto [lowest, highest] = std::ranges::minmax(minima);
  const std::size_t count = different_energies(minima);
  if (count == 1) return absl::StrFormat("minima of 1 energy were seen, E = %.6g", lowest);
  return absl::StrFormat("minima of %u energies were seen, E from %.6g to %.6g", count, lowest, highest);
}

}  // namespace

std::size_t different_energies(std::vector<double> minima) {
  std::ranges::sort(minima);
  std::size_t count = 0;
  for (std::size_t k = 0; k < minima.size(); ++k)
    count += k == 0 || minima[k] > (1 + kSameEnergy) * minima[k - 1] ? 1 : 0;
  return count;
}

std::string search_text(const client::SolveResult& result) {
  if (result.minima.empty()) return without_minimum(result.stop_reason);
  if (result.further_starts > 0)
    return absl::StrCat("looked for lower minima from ", starts_text(result), "; ",
                        energies_text(result.minima));
  if (result.search_iterations > 0) return "the search for lower minima ended before its first start did";
  return absl::StrCat("no other minima were looked for (effort ", result.effort, ")");
}

}  // namespace lpdeform::cli
