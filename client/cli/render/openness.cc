#include "client/cli/render/openness.h"

#include <algorithm>
#include <cmath>

namespace lpdeform {
namespace {

constexpr double kReachInDiagonals = 0.05;
constexpr double kReachInHeights = 0.06;  // about this share of the picture's height
// Below this height, curvature and rounding raise neighbours above the tangent plane, too.
constexpr float kLeastHeight = 0.1F;

/// A pseudo-random number in [0, 1) for each pixel.
double scattered(int x, int y) {
  const double seed = 52.9829189 * std::fmod(0.06711056 * x + 0.00583715 * y, 1.0);
  return seed - std::floor(seed);
}

}  // namespace

/// Offsets of pixels within `radius`, evenly spread, the nearest first.
Openness::Offsets Openness::turned_spiral(double angle, double radius) {
  constexpr double kGoldenAngle = 2.39996322972865;
  Offsets result{};
  for (int k = 0; k < kNeighbours; ++k) {
    const double distance = radius * (k + 0.5) / kNeighbours, direction = angle + k * kGoldenAngle;
    result[k] = {static_cast<int>(std::lround(distance * std::cos(direction))),
                 static_cast<int>(std::lround(distance * std::sin(direction)))};
  }
  return result;
}

Openness::Openness(const Scene& scene, int side, const Workers& workers)
    : scene_(scene),
      side_(side),
      width_(scene.width() / side),
      height_(scene.height() / side),
      points_(static_cast<std::size_t>(width_) * height_) {
  const double reach = kReachInDiagonals * scene.diagonal();
  reach2_ = static_cast<float>(reach * reach);
  for (int k = 0; k < kTurns; ++k)
    offsets_[k] = turned_spiral(2 * M_PI * k / kTurns, kReachInHeights * height_);
  workers.for_chunks(static_cast<std::size_t>(height_), 16,
                     [&](std::size_t, std::size_t begin, std::size_t end) { find_points(begin, end); });
}

/// For the rows from `begin` to `end` - 1.
void Openness::find_points(std::size_t begin, std::size_t end) {
  for (std::size_t y = begin; y < end; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Eigen::RowVector3f point =
          scene_.point_at(side_ * x + side_ / 2, side_ * static_cast<int>(y) + side_ / 2).cast<float>();
      points_[y * width_ + x] = {point[0], point[1], point[2]};
    }
  }
}

double Openness::at(int x, int y) const {
  const Point& here = points_[static_cast<std::size_t>(y) * width_ + x];
  if (std::isnan(here.x)) return 1;
  const Eigen::RowVector3f normal =
      scene_.normal_at(side_ * x + side_ / 2, side_ * y + side_ / 2).cast<float>();
  const auto turn = static_cast<std::size_t>(kTurns * scattered(x, y));
  float hidden = 0;
  for (const Offset& offset : offsets_[std::min<std::size_t>(turn, kTurns - 1)]) {
    const int other_x = x + offset.right, other_y = y + offset.down;
    if (other_x < 0 || other_x >= width_ || other_y < 0 || other_y >= height_) continue;
    const Point& other = points_[static_cast<std::size_t>(other_y) * width_ + other_x];
    const float right = other.x - here.x, down = other.y - here.y, away = other.z - here.z;
    const float above = normal[0] * right + normal[1] * down + normal[2] * away;
    const float distance2 = right * right + down * down + away * away;
    // Most neighbours stop here, background included; comparing squares avoids a square root.
    if (!(above > 0 && above * above > kLeastHeight * kLeastHeight * distance2)) continue;
    hidden += (above / std::sqrt(distance2) - kLeastHeight) / (1 + distance2 / reach2_);
  }
  return std::clamp(1 - 2.2 * static_cast<double>(hidden) / kNeighbours, 0.0, 1.0);
}

}  // namespace lpdeform
