#include "client/cli/render/raster.h"

namespace lpdeform {
namespace {

/// The samples (at k + 0.5) between two coordinates, clipped to the picture: a half-open range.
std::array<int, 2> samples_between(double low, double high, int size) {
  const double first = std::clamp(std::ceil(low - 0.5), 0.0, double(size));
  const double last = std::clamp(std::floor(high - 0.5) + 1, 0.0, double(size));
  return {static_cast<int>(first), static_cast<int>(last)};
}

}  // namespace

void Raster::draw(std::int32_t face, const std::array<Eigen::RowVector3d, 3>& corners) {
  const auto& [p, q, r] = corners;
  const double area = (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
  if (area == 0 || !std::isfinite(area)) return;
  const auto [top, bottom] =
      samples_between(std::min({p[1], q[1], r[1]}), std::max({p[1], q[1], r[1]}), height_);
  const auto [left, right] =
      samples_between(std::min({p[0], q[0], r[0]}), std::max({p[0], q[0], r[0]}), width_);
  constexpr double kOverlap = -1e-9;  // so that no gap opens between neighbours
  for (int y = top; y < bottom; ++y) {
    for (int x = left; x < right; ++x) {
      const double dx = x + 0.5 - p[0], dy = y + 0.5 - p[1];
      const double b = (dx * (r[1] - p[1]) - dy * (r[0] - p[0])) / area;
      const double c = (dy * (q[0] - p[0]) - dx * (q[1] - p[1])) / area;
      if (b < kOverlap || c < kOverlap || b + c > 1 - kOverlap) continue;
      const auto depth = static_cast<float>(p[2] + b * (q[2] - p[2]) + c * (r[2] - p[2]));
      Sample& sample = samples_[std::size_t(y) * width_ + x];
      if (depth > sample.inverse_depth) sample = {face, depth, static_cast<float>(b), static_cast<float>(c)};
    }
  }
}

}  // namespace lpdeform
