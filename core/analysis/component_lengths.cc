#include "core/analysis/component_lengths.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/analysis/face_geometry.h"

namespace lpdeform {
namespace {

constexpr double kShareOfSize = 0.04;

}  // namespace

std::vector<double> component_lengths(const RestShape& shape) {
  const auto count = static_cast<std::size_t>(shape.component_count());
  const Points& x = shape.scaled_positions();
  std::vector<double> areas(count, 0.0), lengths(count, 0.0), edges(count, 0.0);
  for (Eigen::Index f = 0; f < shape.faces().rows(); ++f)
    areas[shape.components()[shape.faces()(f, 0)]] += face_geometry(shape, f).area;
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    const std::int32_t c = shape.components()[i];
    for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
      lengths[c] += (x.row(i) - x.row(shape.neighbours()[k])).norm();
      edges[c] += 1;
    }
  }
  for (std::size_t c = 0; c < count; ++c) {
    const double mean_edge = edges[c] > 0 ? lengths[c] / edges[c] : 0;
    lengths[c] =
        std::max({kShareOfSize * std::sqrt(areas[c]), mean_edge, std::numeric_limits<double>::min()});
  }
  return lengths;
}

}  // namespace lpdeform
