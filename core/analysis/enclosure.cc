#include "core/analysis/enclosure.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/analysis/face_geometry.h"
#include "core/analysis/surface_smoother.h"

namespace lpdeform {
namespace {

// With 0.15, noise of 5 % of the radius leaves joints of up to 0.17 on tubes of 12 to 48 faces around. With 0.1 it
// leaves up to 0.23, which automatic_material() would treat as joints. With 0.2, smoothing changes the joints of
// pierced_block(34), which is thick for the size of its tunnels, by a quarter more than with 0.15.
constexpr double kShareOfThickness = 0.15;
constexpr double kNoLength = 1e-6;  // scaled units: so small that nothing moves

/// The median thickness: the smallest that half of the area does not exceed.
Enclosure enclosure_of(std::vector<std::pair<double, double>>& thickness_and_area) {
  std::sort(thickness_and_area.begin(), thickness_and_area.end());
  double all = 0, known = 0, below = 0;
  for (const auto& [thickness, area] : thickness_and_area) {
    all += area;
    if (std::isfinite(thickness)) known += area;
  }
  for (const auto& [thickness, area] : thickness_and_area) {
    below += area;
    if (below >= all / 2) return {thickness, all > 0 ? known / all : 0};
  }
  return {std::numeric_limits<double>::infinity(), 0};
}

}  // namespace

double Enclosure::noise_length() const {
  return std::isfinite(thickness) ? kShareOfThickness * thickness : 0;
}

std::vector<Enclosure> enclosures(const RestShape& shape, const std::vector<double>& thickness) {
  std::vector<std::vector<std::pair<double, double>>> faces(
      static_cast<std::size_t>(shape.component_count()));
  for (Eigen::Index f = 0; f < shape.faces().rows(); ++f)
    faces[shape.components()[shape.faces()(f, 0)]].emplace_back(thickness[f], face_geometry(shape, f).area);
  std::vector<Enclosure> result;
  for (auto& component : faces) result.push_back(enclosure_of(component));
  return result;
}

std::shared_ptr<const RestShape> without_noise(const RestShape& shape,
                                               const std::vector<Enclosure>& components) {
  std::vector<double> lengths;
  for (const Enclosure& component : components)
    lengths.push_back(std::max(component.noise_length(), kNoLength));
  SurfaceSmoother smoother(shape);
  if (!smoother.set_lengths(lengths)) return nullptr;
  const Points weighted = shape.scaled_positions().array().colwise() * smoother.areas().array();
  auto smoothed = RestShape::create({smoother.spread(weighted), shape.faces()}, shape.weight_kind());
  return smoothed.ok() ? *std::move(smoothed) : nullptr;
}

}  // namespace lpdeform
