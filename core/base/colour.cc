#include "core/base/colour.h"

#include <algorithm>
#include <cmath>

namespace lpdeform {
namespace {

constexpr std::array<std::array<double, 3>, 5> kStops{
    {{38, 70, 200}, {60, 180, 230}, {90, 195, 95}, {250, 220, 60}, {215, 40, 35}}};

/// The smallest value that at least 95 % of the others do not exceed.
double percentile_95(const Field& values) {
  std::vector<double> sorted(values.data(), values.data() + values.size());
  const auto place = sorted.begin() + static_cast<std::ptrdiff_t>(std::ceil(0.95 * sorted.size())) - 1;
  std::nth_element(sorted.begin(), place, sorted.end());
  return *place;
}

}  // namespace

Rgb blue_to_red(double t) {
  const double scaled = std::clamp(t, 0.0, 1.0) * (kStops.size() - 1);
  const auto stop = std::min(static_cast<std::size_t>(scaled), kStops.size() - 2);
  Rgb colour;
  for (int channel = 0; channel < 3; ++channel) {
    colour[channel] = static_cast<std::uint8_t>(
        std::lround(std::lerp(kStops[stop][channel], kStops[stop + 1][channel], scaled - stop)));
  }
  return colour;
}

double distortion_of_red(const Field& distortion) {
  if (distortion.size() == 0) return 0;
  const double percentile = percentile_95(distortion);
  return percentile > 0 ? percentile : std::max(0.0, distortion.maxCoeff());
}

std::vector<Rgb> distortion_colours(const Field& distortion) {
  const double red = distortion_of_red(distortion);
  std::vector<Rgb> colours;
  colours.reserve(distortion.size());
  for (const double value : distortion) colours.push_back(blue_to_red(red > 0 ? value / red : 0));
  return colours;
}

}  // namespace lpdeform
