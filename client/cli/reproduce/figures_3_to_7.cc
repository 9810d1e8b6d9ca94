#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/reproduce/figure.h"
#include "client/cli/reproduce/markup.h"
#include "client/cli/reproduce/pictures.h"
#include "client/cli/reproduce/statistics.h"
#include "core/shapes/shapes.h"

namespace lpdeform::reproduce {
namespace {

using Rims = std::vector<std::vector<std::int32_t>>;

/// The share of the 5 % most distorted cells falls strictly as p grows.
Claim smaller_p_concentrates(const Experiment& experiment, const std::string& text) {
  Claim claim{text, "Share of the 5 % most distorted cells in the sum of all:", true, {}};
  double before = std::numeric_limits<double>::infinity();
  for (const auto& [p, solve] : experiment.by_p) {
    const double share = top_share(solve.energies);
    absl::StrAppend(&claim.measured, before < 2 ? "," : "", " L", p, " ", percent_text(share));
    claim.numbers.emplace_back(absl::StrCat("top_5_percent_share_p", p), share);
    claim.holds = claim.holds && share < before;
    before = share;
  }
  claim.measured += ".";
  return claim;
}

std::vector<Picture> pictures_for(const Experiment& experiment, const std::vector<double>& ps) {
  std::vector<Picture> pictures{rest_picture(experiment)};
  for (const double p : ps) pictures.push_back(solved_picture(experiment, p));
  return pictures;
}

/// The vertices around a tunnel's openings: those near its wall that are farther than `depth` along its axis,
/// on either side.
Rims rims_of(const Points& rest, int axis, double radius, double depth) {
  Rims rims(2);
  for (Eigen::Index i = 0; i < rest.rows(); ++i) {
    Eigen::RowVector3d across = rest.row(i);
    across[axis] = 0;
    if (across.norm() > 1.2 * radius || std::abs(rest(i, axis)) < depth) continue;
    rims[rest(i, axis) > 0 ? 1 : 0].push_back(static_cast<std::int32_t>(i));
  }
  return rims;
}

double mean_axis_ratio(const Experiment& experiment, const Rims& rims, double p) {
  double sum = 0;
  for (const std::vector<std::int32_t>& rim : rims)
    sum += axis_ratio(experiment.rest(), experiment.by_p.at(p).positions, rim);
  return sum / static_cast<double>(rims.size());
}

Claim one_keeps_circles(const Experiment& experiment, const Rims& rims) {
  const double one = mean_axis_ratio(experiment, rims, 1), two = mean_axis_ratio(experiment, rims, 2);
  return {"When an object is stretched, L1 preserves structures such as circular holes much better than L2.",
          absl::StrFormat(
              "Axis ratio of the ellipses that the %d rims of holes become, in the mean (1 is a circle): "
              "L1 %.3f, L2 %.3f.",
              rims.size(), one, two),
          std::abs(one - 1) < std::abs(two - 1),
          {{"axis_ratio_p1", one}, {"axis_ratio_p2", two}}};
}

}  // namespace

Figure figure_3(const Measurements& measured) {
  return {"figure_3",
          "Figure 3: a sheet is folded",
          "One edge of a thin sheet stays, the other is translated over it.",
          {smaller_p_concentrates(
              measured.sheet,
              "With a small p the unavoidable distortion is highly concentrated on certain regions, "
              "with a large p it is spread rather uniformly.")},
          "",
          pictures_for(measured.sheet, {1, 1.5, 2, 6}),
          ""};
}

Figure figure_4(const Measurements& measured) {
  return {
      "figure_4",
      "Figure 4: a bar is twisted",
      "Both ends of a bar stay, its middle is twisted by 90 degrees.",
      {smaller_p_concentrates(
          measured.bar, "With increasing p the distortion is distributed more evenly over the whole model.")},
      "",
      pictures_for(measured.bar, {1, 1.5, 2, 6}),
      ""};
}

Figure figure_5(const Measurements& measured) {
  Rims rims;
  for (const int axis : {0, 1}) {
    for (auto& rim :
         rims_of(measured.block.rest(), axis, PiercedBlock::kHoleRadius, 0.8 * PiercedBlock::kHalfSide))
      rims.push_back(std::move(rim));
  }
  return {
      "figure_5",
      "Figure 5: a block with round holes is stretched",
      "A cube with two crossing round tunnels between two shafts (genus 3); the lower shaft's end stays, the "
      "upper one's is pulled.",
      {one_keeps_circles(measured.block, rims)},
      "",
      pictures_for(measured.block, {1, 2}),
      ""};
}

Figure figure_6(const Measurements& measured) {
  const Experiment& creature = measured.creature;
  const std::vector<std::int32_t>& head = creature.pose.handles.handles().at("head").vertices;
  const double size = diagonal(creature.rest());
  const auto far_away = [&](double p) {
    return displacement_far_from(creature.rest(), creature.by_p.at(p).positions, head, size / 2) / size;
  };
  const double one = far_away(1), two = far_away(2);
  return {
      "figure_6",
      "Figure 6: a creature turns its head",
      "The feet stay, the head is lifted and turned by 60 degrees.",
      {{"With L1 the deformation is less likely to affect regions far away from the handles than with L2.",
        absl::StrFormat(
            "Root-mean-square displacement farther than half the diagonal from the head, in diagonals: "
            "L1 %.2g, L2 %.2g.",
            one, two),
        one < two,
        {{"far_displacement_p1", one}, {"far_displacement_p2", two}}}},
      "",
      pictures_for(creature, {1, 2}),
      ""};
}

Figure figure_7(const Measurements& measured) {
  const Rims rims = rims_of(measured.arm.rest(), 2, RockerArm::kHoleRadius, 0.3 * RockerArm::kHoleRadius);
  return {"figure_7",
          "Figure 7: a rocker arm is stretched",
          "An arm with a ring (genus 1); the end of the tail stays, the head is pulled.",
          {one_keeps_circles(measured.arm, rims)},
          "",
          pictures_for(measured.arm, {1, 2}),
          ""};
}

Figure other_mesh(const Experiment& experiment) {
  return {absl::StrCat("mesh_", experiment.pose.name),
          absl::StrCat("Another mesh: ", experiment.pose.name),
          "Not from the paper; read from a file with its handles.",
          {smaller_p_concentrates(experiment,
                                  "The smaller p is, the more the distortion concentrates in few places.")},
          "",
          pictures_for(experiment, {1, 2}),
          ""};
}

}  // namespace lpdeform::reproduce
