#include "core/certificate/convex_rows.h"

#include <cmath>

namespace lpdeform {

/// Valid for i = count() as well.
Eigen::Index ConvexRows::begin(std::int32_t i) const {
  const std::int32_t n = shape_.vertex_count();
  return i <= n ? shape_.offsets()[i] : edges() + soft_.offsets()[i - n];
}

double ConvexRows::exponent(std::int32_t i) const {
  const std::int32_t n = shape_.vertex_count();
  return i < n ? problem_.norm.p(i) : soft_.exponent(i - n, problem_.norm);
}

double ConvexRows::coefficient(std::int32_t i) const {
  const std::int32_t n = shape_.vertex_count();
  return i < n ? problem_.norm.coefficient(i) : soft_.coefficient(i - n, problem_.norm);
}

double ConvexRows::weight(std::int32_t i) const {
  const std::int32_t n = shape_.vertex_count();
  if (i < n) return problem_.metric.cell_weight(i);
  return soft_weights_[i - n];
}

void ConvexRows::residuals(const Points& x, EdgeVectors& z) const {
  lpdeform::residuals(shape_, x, problem_.objective.cells().rotations(), z);
  z.conservativeResize(begin(count()), 3);
  for (std::size_t r = 0; r < soft_.rows().size(); ++r) {
    const SoftRow& row = soft_.rows()[r];
    z.row(edges() + static_cast<Eigen::Index>(r)) = std::sqrt(row.weight) * (row.point.at(x) - row.target);
  }
}

void ConvexRows::apply(const Points& u, EdgeVectors& result) const {
  apply_edges(shape_, u, result);
  result.conservativeResize(begin(count()), 3);
  for (std::size_t r = 0; r < soft_.rows().size(); ++r) {
    const SoftRow& row = soft_.rows()[r];
    result.row(edges() + static_cast<Eigen::Index>(r)) = std::sqrt(row.weight) * row.point.at(u);
  }
}

void ConvexRows::apply_transposed(const EdgeVectors& y, Points& result) const {
  apply_edges_transposed(shape_, y, problem_.constraints.is_held, result);
  for (std::size_t r = 0; r < soft_.rows().size(); ++r) {
    const SoftRow& row = soft_.rows()[r];
    const Eigen::RowVector3d force = std::sqrt(row.weight) * y.row(edges() + static_cast<Eigen::Index>(r));
    for (std::int32_t j = 0; j < row.point.count; ++j) {
      result.row(row.point.vertices[j]) += row.point.coefficients[j] * force;
    }
  }
  restrict_to_free(problem_.constraints, result);
}

bool ConvexRows::factor() {
  soft_weights_ = problem_.objective.soft_weights();
  return problem_.factor_metric(Metric::Precision::kSingle);
}

bool ConvexRows::factor(const std::vector<double>& weights) {
  const auto soft = weights.begin() + shape_.vertex_count();
  soft_weights_.assign(soft, weights.end());
  std::vector<MatrixEntry> entries = soft_.matrix_entries(soft_weights_);
  problem_.constraints.linear.add_ties(2, entries);
  return problem_.metric.factor({weights.begin(), soft}, problem_.constraints.is_held, entries,
                                problem_.workers(), Metric::Precision::kDouble);
}

}  // namespace lpdeform
