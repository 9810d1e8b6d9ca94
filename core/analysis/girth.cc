#include "core/analysis/girth.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace lpdeform {
namespace {

constexpr int kSlabs = 50;  // per component extent
constexpr int kReach = 2;   // slabs on either side that a mean includes

/// One component's outline, slab by slab.
struct Outline {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  std::vector<double> lengths = std::vector<double>(kSlabs, 0.0);

  bool has_extent() const { return high > low; }
  /// The height in slabs, from 0 to kSlabs.
  double place(double height) const { return (height - low) / (high - low) * kSlabs; }

  /// Adds `area`, spread evenly over the heights from `begin` to `end`.
  void add(double area, double begin, double end) {
    if (!(end > begin)) return;
    const int last = std::min(kSlabs - 1, static_cast<int>(end));
    for (int slab = std::max(0, static_cast<int>(begin)); slab <= last; ++slab)
      lengths[slab] +=
          area * std::max(0.0, std::min(slab + 1.0, end) - std::max(1.0 * slab, begin)) / (end - begin);
  }

  /// Replaces each slab by the mean of its neighbourhood, divided by the mean of all slabs.
  void normalise() {
    double all = 0;
    for (const double length : lengths) all += length / kSlabs;
    const std::vector<double> sharp = lengths;
    for (int slab = 0; slab < kSlabs; ++slab) {
      const int first = std::max(0, slab - kReach), last = std::min(kSlabs - 1, slab + kReach);
      double sum = 0;
      for (int k = first; k <= last; ++k) sum += sharp[k];
      lengths[slab] = all > 0 ? sum / (last - first + 1) / all : 1;
    }
  }

  /// Interpolates linearly between the slabs' middles.
  double at(double height) const {
    const double middle = std::clamp(place(height) - 0.5, 0.0, kSlabs - 1.0);
    const int slab = std::min(static_cast<int>(middle), kSlabs - 2);
    return lengths[slab] + (middle - slab) * (lengths[slab + 1] - lengths[slab]);
  }
};

}  // namespace

Field girth_along(const RestShape& shape, const Eigen::Vector3d& direction) {
  const Points& x = shape.scaled_positions();
  const Eigen::VectorXd heights = x * direction;
  std::vector<Outline> outlines(static_cast<std::size_t>(shape.component_count()));
  for (Eigen::Index i = 0; i < heights.size(); ++i) {
    const std::int32_t component = shape.components()[i];
    if (component < 0) continue;
    outlines[component].low = std::min(outlines[component].low, heights[i]);
    outlines[component].high = std::max(outlines[component].high, heights[i]);
  }
  for (const auto& face : shape.faces().rowwise()) {
    Outline& outline = outlines[shape.components()[face[0]]];
    if (!outline.has_extent()) continue;
    const Eigen::Vector3d a = x.row(face[0]), b = x.row(face[1]), c = x.row(face[2]);
    // The part of a face's area that slices cut: all of an upright face, nothing of a flat one.
    const double area = 0.5 * (b - a).cross(c - a).cross(direction).norm();
    const auto [low, high] = std::minmax({heights[face[0]], heights[face[1]], heights[face[2]]});
    outline.add(area, outline.place(low), outline.place(high));
  }
  for (Outline& outline : outlines) outline.normalise();
  Field result = Field::Ones(heights.size());
  for (Eigen::Index i = 0; i < heights.size(); ++i) {
    const std::int32_t component = shape.components()[i];
    if (component >= 0 && outlines[component].has_extent()) result[i] = outlines[component].at(heights[i]);
  }
  return result;
}

}  // namespace lpdeform
