#include "core/methods/residuals.h"

#include <cmath>

namespace lpdeform {

void residuals(const RestShape& shape, const Points& x, const std::vector<Eigen::Matrix3d>& rotations,
               EdgeVectors& z) {
  const Points& rest = shape.scaled_positions();
  z.resize(shape.neighbours().size(), 3);
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
      const std::int32_t j = shape.neighbours()[k];
      const Eigen::Vector3d edge = (rest.row(i) - rest.row(j)).transpose();
      z.row(k) = std::sqrt(shape.weights()[k]) * ((x.row(i) - x.row(j)) - (rotations[i] * edge).transpose());
    }
  }
}

void apply_edges(const RestShape& shape, const Points& u, EdgeVectors& result) {
  result.resize(shape.neighbours().size(), 3);
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
      result.row(k) = std::sqrt(shape.weights()[k]) * (u.row(i) - u.row(shape.neighbours()[k]));
    }
  }
}

void apply_edges_transposed(const RestShape& shape, const EdgeVectors& y, const std::vector<char>& is_held,
                            Points& result) {
  result = Points::Zero(shape.vertex_count(), 3);
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
      const std::int32_t j = shape.neighbours()[k];
      const Eigen::RowVector3d term = std::sqrt(shape.weights()[k]) * y.row(k);
      if (!is_held[i]) result.row(i) += term;
      if (!is_held[j]) result.row(j) -= term;
    }
  }
}

double cell_norm(const RestShape& shape, const EdgeVectors& y, std::int32_t i) {
  return y.middleRows(shape.offsets()[i], shape.offsets()[i + 1] - shape.offsets()[i]).norm();
}

}  // namespace lpdeform
