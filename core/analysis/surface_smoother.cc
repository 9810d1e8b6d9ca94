#include "core/analysis/surface_smoother.h"

#include "core/analysis/face_geometry.h"

namespace lpdeform {
namespace {

constexpr double kSmallestArea = 1e-9;  // relative to the mean; for vertices with only zero-area faces

Field cell_areas(const RestShape& shape) {
  const Field areas = vertex_areas(shape);
  return areas.cwiseMax(kSmallestArea * areas.mean());
}

/// The pattern of M + L. The edges are sorted with the lower vertex first, which is the order that the columns need.
LowerMatrix pattern_of(std::int32_t vertex_count, const EdgeWeights& edges) {
  LowerMatrix matrix;
  matrix.columns.push_back(0);
  std::size_t edge = 0;
  for (std::int32_t i = 0; i < vertex_count; ++i) {
    matrix.rows.push_back(i);
    for (; edge < edges.edges.size() && edges.edges[edge][0] == i; ++edge)
      matrix.rows.push_back(edges.edges[edge][1]);
    matrix.columns.push_back(static_cast<std::int32_t>(matrix.rows.size()));
  }
  matrix.values.assign(matrix.rows.size(), 0.0);
  return matrix;
}

}  // namespace

SurfaceSmoother::SurfaceSmoother(const RestShape& shape)
    : shape_(shape),
      edges_(edge_weights({shape.positions(), shape.faces()}, WeightKind::kCotangent)),
      areas_(cell_areas(shape)),
      matrix_(pattern_of(shape.vertex_count(), edges_)),
      factor_(matrix_) {}

bool SurfaceSmoother::set_lengths(const std::vector<double>& lengths) {
  std::vector<double>& values = matrix_.values;
  for (std::int32_t i = 0; i < shape_.vertex_count(); ++i) values[matrix_.columns[i]] = areas_[i];
  std::size_t edge = 0;
  for (std::int32_t i = 0; i < shape_.vertex_count(); ++i) {
    for (std::int32_t entry = matrix_.columns[i] + 1; entry < matrix_.columns[i + 1]; ++entry, ++edge) {
      const double length = lengths[shape_.components()[i]];
      const double value = length * length * edges_.weights[edge];
      values[entry] = -value;
      values[matrix_.columns[i]] += value;
      values[matrix_.columns[matrix_.rows[entry]]] += value;
    }
  }
  return factor_.factor(matrix_);
}

Points SurfaceSmoother::spread(const Points& b) const {
  Points u;
  factor_.solve(b, u);
  return u;
}

}  // namespace lpdeform
