// Statements of the paper outside its figures: sections 3.2 and 5.

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/reproduce/figure.h"
#include "client/cli/reproduce/markup.h"

namespace lpdeform::reproduce {
namespace {

constexpr double kOneMinimum = 1e-6;  // of E^(1/p): results that differ by no more than this count as one
constexpr double kCertified = 1e-3;   // largest proved distance from the minimum
constexpr double kMostOnHalving = 0.75;

std::string key(const std::string& shape, double p) {
  std::string text = absl::StrCat(shape, "_p", p);
  std::ranges::replace(text, '.', '_');
  return text;
}

Claim one_minimum(const Measurements& measured) {
  double spread = 0;
  Claim claim{
      "For fixed rotations the energy is convex, so that its global minimum is found.", "", false, {}};
  for (const Minimum& minimum : measured.minima) {
    spread = std::max(spread, minimum.step.spread());
    claim.numbers.emplace_back(absl::StrCat(key(minimum.shape, minimum.step.p), "_spread"),
                               minimum.step.spread());
  }
  claim.holds = spread <= kOneMinimum;
  claim.measured = absl::StrFormat(
      "From %d starts each, %d of them random, %d descents end with values of E^(1/p) that differ by at "
      "most %.1e of it. The claim holds if none differs by more than %g.",
      2 + kRandomStarts, kRandomStarts, (2 + kRandomStarts) * static_cast<int>(measured.minima.size()),
      spread, kOneMinimum);
  return claim;
}

Claim certified_minimum(const Measurements& measured) {
  double worst = 0;
  Claim claim{"What is found is the global minimum of this convex problem, and no local one.", "", false, {}};
  for (const Minimum& minimum : measured.minima) {
    worst = std::max(worst, minimum.step.certified);
    claim.numbers.emplace_back(absl::StrCat(key(minimum.shape, minimum.step.p), "_gap"),
                               minimum.step.certified);
  }
  claim.holds = worst <= kCertified;
  claim.measured = absl::StrFormat(
      "The dual problem proves that no positions have an E^(1/p) lower by more than %.1e of it. The claim "
      "holds if this bound is at most %g.",
      worst, kCertified);
  return claim;
}

std::string minima_table(const Measurements& measured) {
  std::vector<std::vector<std::string>> rows;
  for (const Minimum& minimum : measured.minima) {
    rows.push_back({absl::StrCat(minimum.shape, ", p = ", minimum.step.p),
                    absl::StrFormat("%.6g", std::ranges::min(minimum.step.lengths)),
                    absl::StrFormat("%.1e", minimum.step.spread()),
                    absl::StrFormat("%.1e", minimum.step.certified)});
  }
  return html_table({"", "lowest E^(1/p)", "highest above it", "proved to be within"}, rows);
}

/// The largest share of the displacement that remains when dp is halved: 0.5 if it is proportional, 1 if
/// there is a jump.
double left_on_halving(const Variation& variation) {
  double most = 0;
  const std::vector<double>& moved = variation.displacements;
  for (std::size_t k = 1; k < moved.size(); ++k)
    most = std::max(most, moved[k - 1] > 0 ? moved[k] / moved[k - 1] : 0);
  return most;
}

Claim varies_continuously(const Measurements& measured, bool is_at_one, std::string text) {
  Claim claim{std::move(text), "", false, {}};
  int count = 0, continuous = 0;
  double most = 0;
  for (const Variation& variation : measured.variations) {
    if ((variation.p == 1) != is_at_one) continue;
    const double left = left_on_halving(variation);
    ++count;
    continuous += left <= kMostOnHalving ? 1 : 0;
    most = std::max(most, left);
    claim.numbers.emplace_back(absl::StrCat(key(variation.shape, variation.p), "_left_on_halving"), left);
  }
  claim.holds = continuous == count;
  claim.measured = absl::StrFormat(
      "With half the step in p the largest displacement is at most %s as large (50 %% would be "
      "proportional). It is at most %s in %d of %d cases. The claim holds if it is in all cases.",
      percent_text(most), percent_text(kMostOnHalving), continuous, count);
  return claim;
}

std::string variations_table(const Measurements& measured) {
  std::vector<std::vector<std::string>> rows;
  for (const Variation& variation : measured.variations) {
    std::vector<std::string> row{absl::StrCat(variation.shape, ", from p = ", variation.p)};
    for (const double moved : variation.displacements) row.push_back(absl::StrFormat("%.3f %%", 100 * moved));
    row.push_back(percent_text(left_on_halving(variation)));
    rows.push_back(std::move(row));
  }
  std::vector<std::string> head{""};
  for (const double step : kSteps) head.push_back(absl::StrCat("p + ", step));
  head.emplace_back("left on halving");
  return html_table(head, rows);
}

}  // namespace

Figure section_3_2(const Measurements& measured) {
  return {"section_3_2",
          "Section 3.2: the global minimum for fixed rotations",
          "The bar for each p; the block, the creature and the arm for p > 1. The rotations are fixed to "
          "those of the naive Laplacian deformation.",
          {one_minimum(measured), certified_minimum(measured)},
          minima_table(measured),
          {},
          "The starts are the naive deformation, the shape at rest, and the naive deformation with each "
          "free vertex moved at random by a tenth of the diagonal. With free rotations there are many "
          "minima, and a solve finds one of them."};
}

Figure section_5(const Measurements& measured) {
  return {
      "section_5",
      "Section 5: continuous variation with p",
      "The paper's five shapes; p goes on from 1, 1.5, 2 and 6, each time from the result before.",
      {varies_continuously(measured, false,
                           "Continuous variations of results can be obtained by changing p alone (from p "
                           "= 1.5, 2 and 6)."),
       varies_continuously(measured, true, "The same from p = 1.")},
      variations_table(measured),
      {},
      "The table shows the largest displacement of a vertex as a share of the diagonal. At p = 1 the "
      "energy is not strictly convex even for fixed rotations, so results of nearly the same energy can be "
      "far apart."};
}

}  // namespace lpdeform::reproduce
