#include "client/cli/render/shading.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace lpdeform {
namespace {

constexpr double kGamma = 2.2;

double to_linear(std::uint8_t channel) {
  static const auto table = [] {
    std::array<double, 256> result{};
    for (std::size_t k = 0; k < result.size(); ++k)
      result[k] = std::pow(static_cast<double>(k) / 255, kGamma);
    return result;
  }();
  return table[channel];
}

/// The channel whose range of linear values, from half a channel below to half a channel above, holds `linear`.
std::uint8_t to_channel(double linear) {
  static const auto lowest = [] {  // of channel k + 1
    std::array<double, 255> result{};
    for (std::size_t k = 0; k < result.size(); ++k)
      result[k] = std::pow((static_cast<double>(k) + 0.5) / 255, kGamma);
    return result;
  }();
  return static_cast<std::uint8_t>(std::upper_bound(lowest.begin(), lowest.end(), linear) - lowest.begin());
}

/// Lambert's cosine, softened so that the terminator lies behind the silhouette of a ball.
double soft_cosine(const Eigen::RowVector3d& normal, const Eigen::RowVector3d& light, double softness) {
  return std::max(0.0, (normal.dot(light) + softness) / (1 + softness));
}

}  // namespace

Rgb shaded(Rgb albedo, const Eigen::RowVector3d& normal, const Eigen::RowVector3d& towards_camera,
           double openness) {
  static const Eigen::RowVector3d kKey = Eigen::RowVector3d(-0.55, 0.62, 0.56).normalized();
  static const Eigen::RowVector3d kFill = Eigen::RowVector3d(0.80, 0.05, 0.60).normalized();
  const double sky = 0.26 + 0.10 * normal[1];
  const double light = 0.80 * soft_cosine(normal, kKey, 0.2) + 0.16 * soft_cosine(normal, kFill, 0) + sky;
  const double gloss = 0.10 * std::pow(std::max(0.0, normal.dot((kKey + towards_camera).normalized())), 30);
  const double shadow = 0.35 + 0.65 * openness;
  Rgb colour;
  for (int channel = 0; channel < 3; ++channel) {
    colour[channel] = to_channel(shadow * (to_linear(albedo[channel]) * light + gloss));
  }
  return colour;
}

Rgb background(double down) {
  const auto level = static_cast<std::uint8_t>(std::lround(std::lerp(250.0, 226.0, down)));
  return {level, level, static_cast<std::uint8_t>(level + 3)};
}

}  // namespace lpdeform
