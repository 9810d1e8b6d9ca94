#include "client/cli/reproduce/pictures.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "client/cli/render/render.h"
#include "client/cli/reproduce/markup.h"

namespace lpdeform::reproduce {
namespace {

constexpr Rgb kPlain{205, 200, 190}, kHandle{40, 90, 225}, kOrange{240, 150, 50};
/// The points of all results together.
Points frame_of(const Experiment& experiment) {
  const Eigen::Index count = experiment.rest().rows();
  Points frame(count * static_cast<Eigen::Index>(experiment.by_p.size()), 3);
  Eigen::Index row = 0;
  for (const auto& [p, solve] : experiment.by_p) {
    frame.middleRows(row, count) = solve.positions;
    row += count;
  }
  return frame;
}

/// Chooses the size, upright for a tall shape, and draws.
Picture drawn(const Experiment& experiment, const Points& positions, PictureStyle style, Picture picture) {
  const Eigen::RowVector3d extent =
      experiment.rest().colwise().maxCoeff() - experiment.rest().colwise().minCoeff();
  const bool is_tall = extent[2] > extent.head<2>().maxCoeff();
  const double scale = std::min(1.0, experiment.size);
  picture.width = style.width = static_cast<int>(scale * (is_tall ? 480 : 720));
  picture.height = style.height = static_cast<int>(scale * (is_tall ? 600 : 540));
  style.has_legend = false;
  picture.png = png_bytes(render(experiment.shape->faces(), positions, style));
  return picture;
}

/// One scale of colours for all p: the value shown in full red is the largest that any of them needs.
double red_of(const Experiment& experiment) {
  double red = 0;
  for (const auto& [p, solve] : experiment.by_p) red = std::max(red, distortion_of_red(solve.energies));
  return red;
}

Picture distortion_picture(const Experiment& experiment, const Solve& solve, Picture picture) {
  PictureStyle style;
  style.distortion = solve.energies;
  style.red = red_of(experiment);
  style.frame = frame_of(experiment);
  absl::StrAppend(&picture.caption, ", largest ", number_text(solve.energies.maxCoeff()), ", red from ",
                  number_text(style.red));
  return drawn(experiment, solve.positions, std::move(style), std::move(picture));
}

Picture coloured_picture(const Experiment& experiment, const std::vector<char>& is_orange, Picture picture) {
  PictureStyle style;
  style.colours.assign(static_cast<std::size_t>(experiment.rest().rows()), kPlain);
  for (std::size_t i = 0; i < is_orange.size(); ++i) {
    if (is_orange[i] != 0) style.colours[i] = kOrange;
  }
  for (const auto& [name, handle] : experiment.pose.handles.handles()) {
    for (const std::int32_t vertex : handle.vertices)
      style.colours[static_cast<std::size_t>(vertex)] = kHandle;
  }
  return drawn(experiment, experiment.rest(), std::move(style), std::move(picture));
}

std::string file_name(const Experiment& experiment, const std::string& what) {
  return absl::StrCat(experiment.pose.name, "_", absl::StrReplaceAll(what, {{".", "_"}}), ".png");
}

}  // namespace

Picture rest_picture(const Experiment& experiment) {
  return coloured_picture(experiment, {}, {file_name(experiment, "rest"), "at rest", "", 0, 0});
}

Picture solved_picture(const Experiment& experiment, double p) {
  const std::string file = file_name(experiment, absl::StrCat("p", p));
  return distortion_picture(experiment, experiment.by_p.at(p), {file, absl::StrCat("L", p), "", 0, 0});
}

Picture region_picture(const Experiment& experiment, const Mixed& mixed) {
  return coloured_picture(experiment, mixed.is_orange,
                          {file_name(experiment, "regions"), "orange: L2, grey: L1", "", 0, 0});
}

Picture mixed_picture(const Experiment& experiment, const Mixed& mixed) {
  return distortion_picture(experiment, mixed.solve, {file_name(experiment, "mixed"), "both", "", 0, 0});
}

}  // namespace lpdeform::reproduce
