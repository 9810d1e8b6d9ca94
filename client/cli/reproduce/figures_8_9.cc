#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_replace.h"
#include "client/cli/reproduce/figure.h"
#include "client/cli/reproduce/markup.h"
#include "client/cli/reproduce/pictures.h"
#include "client/cli/reproduce/statistics.h"

namespace lpdeform::reproduce {
namespace {

/// The free vertices of a region.
std::vector<std::int32_t> region(const Experiment& experiment, const Mixed& mixed, bool is_orange) {
  std::vector<char> is_held(mixed.is_orange.size(), 0);
  for (const auto& [name, handle] : experiment.pose.handles.handles()) {
    for (const std::int32_t vertex : handle.vertices) is_held[static_cast<std::size_t>(vertex)] = 1;
  }
  std::vector<std::int32_t> result;
  for (std::size_t i = 0; i < is_held.size(); ++i) {
    if (is_held[i] == 0 && (mixed.is_orange[i] != 0) == is_orange)
      result.push_back(static_cast<std::int32_t>(i));
  }
  return result;
}

/// In a region, the top-5 % share of the mixed solve is closer to that of the region's own p than to that of
/// the other p.
Claim region_is_like_its_own(const Experiment& experiment, const Mixed& mixed, bool is_orange) {
  const std::vector<std::int32_t> vertices = region(experiment, mixed, is_orange);
  const auto share = [&](const Solve& solve) { return top_share(at(solve.energies, vertices)); };
  const double both = share(mixed.solve), one = share(experiment.by_p.at(1)),
               two = share(experiment.by_p.at(2));
  const double own = is_orange ? two : one, other = is_orange ? one : two;
  const char* const name = is_orange ? "L2" : "L1";
  return {absl::StrCat("In the region of ", name, " the energy is distributed as ", name,
                       " alone would distribute it."),
          absl::StrFormat(
              "Share of the region's 5 %% most distorted cells in its sum: %s with both norms, %s with L1 "
              "everywhere, %s with L2 everywhere.",
              percent_text(both), percent_text(one), percent_text(two)),
          std::abs(both - own) < std::abs(both - other),
          {{"top_5_percent_share_mixed", both},
           {"top_5_percent_share_p1", one},
           {"top_5_percent_share_p2", two}}};
}

std::vector<Claim> claims(const Experiment& experiment, const Mixed& mixed) {
  return {region_is_like_its_own(experiment, mixed, false), region_is_like_its_own(experiment, mixed, true)};
}

}  // namespace

Figure figure_8(const Measurements& measured) {
  return {"figure_8",
          "Figure 8: a sheet of two norms is folded",
          "The fold of Figure 3 with L2 in one half of the sheet's width (orange) and L1 in the other.",
          claims(measured.sheet, measured.mixed_sheet),
          "",
          {region_picture(measured.sheet, measured.mixed_sheet),
           mixed_picture(measured.sheet, measured.mixed_sheet)},
          ""};
}

Figure figure_9(const Measurements& measured) {
  Picture everywhere = solved_picture(measured.block, 2);
  everywhere.caption = absl::StrReplaceAll(everywhere.caption, {{"L2", "L2 everywhere"}});
  return {
      "figure_9",
      "Figure 9: a block of two norms is stretched",
      "The stretch of Figure 5 with L2 in the upper half (orange) and L1 in the lower, beside L2 everywhere.",
      claims(measured.block, measured.mixed_block),
      "",
      {region_picture(measured.block, measured.mixed_block),
       mixed_picture(measured.block, measured.mixed_block), everywhere},
      ""};
}

}  // namespace lpdeform::reproduce
