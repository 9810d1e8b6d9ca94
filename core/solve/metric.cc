#include "core/solve/metric.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lpdeform {
namespace {

LowerMatrix lower_pattern(const RestShape& shape) {
  LowerMatrix matrix;
  const std::int32_t n = shape.vertex_count();
  matrix.columns.reserve(n + 1);
  matrix.columns.push_back(0);
  for (std::int32_t i = 0; i < n; ++i) {
    matrix.rows.push_back(i);
    for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
      if (shape.neighbours()[k] > i) matrix.rows.push_back(shape.neighbours()[k]);
    }
    matrix.columns.push_back(static_cast<std::int32_t>(matrix.rows.size()));
  }
  matrix.values.assign(matrix.rows.size(), 0.0);
  return matrix;
}

}  // namespace

Metric::Metric(std::shared_ptr<const RestShape> shape)
    : shape_(std::move(shape)), matrix_(lower_pattern(*shape_)), factor_(matrix_) {}

bool Metric::factor(const std::vector<double>& cell_weights, const std::vector<char>& is_held,
                    const std::vector<MatrixEntry>& entries) {
  const double largest = *std::max_element(cell_weights.begin(), cell_weights.end());
  if (!(largest > 0) || !std::isfinite(largest)) return is_good_ = false;
  std::vector<double> clipped(cell_weights.size());
  std::transform(cell_weights.begin(), cell_weights.end(), clipped.begin(),
                 [&](double weight) { return std::max(weight / largest, kLowestShare); });
  std::vector<MatrixEntry> scaled = entries;
  for (MatrixEntry& entry : scaled) entry.value /= largest;
  scale_ = largest;
  if (is_good_ && is_held == is_held_ && clipped == cell_weights_ && scaled == entries_) return true;
  single_.clear();
  cell_weights_ = std::move(clipped);
  is_held_ = is_held;
  entries_ = std::move(scaled);
  for (std::int32_t i = 0; i < shape_->vertex_count(); ++i) {
    double diagonal = 0;
    std::int32_t entry = matrix_.columns[i];
    for (std::int32_t k = shape_->offsets()[i]; k < shape_->offsets()[i + 1]; ++k) {
      const std::int32_t j = shape_->neighbours()[k];
      const double weight = edge_weight(i, k);
      diagonal += weight;
      if (j > i) matrix_.values[++entry] = is_held[i] || is_held[j] ? 0.0 : -weight;
    }
    matrix_.values[matrix_.columns[i]] = is_held[i] ? 1.0 : diagonal;
  }
  for (const MatrixEntry& entry : entries_) add_entry(entry);
  ++version_;
  return is_good_ = factor_.factor(matrix_);
}

void Metric::add_entry(const MatrixEntry& entry) {
  if (is_held_[entry.row] || is_held_[entry.column]) return;
  const auto begin = matrix_.rows.begin() + matrix_.columns[entry.column];
  const auto end = matrix_.rows.begin() + matrix_.columns[entry.column + 1];
  const auto found = std::lower_bound(begin, end, entry.row);
  if (found != end && *found == entry.row) {
    matrix_.values[found - matrix_.rows.begin()] += entry.value;
    return;
  }
  for (const std::int32_t i : {entry.row, entry.column})
    matrix_.values[matrix_.columns[i]] += std::abs(entry.value);
}

void Metric::adopt(const std::vector<double>& cell_weights) {
  const double present = std::accumulate(cell_weights_.begin(), cell_weights_.end(), 0.0);
  const double wanted = std::accumulate(cell_weights.begin(), cell_weights.end(), 0.0);
  if (wanted > 0 && std::isfinite(wanted)) scale_ = wanted / present;
}

void Metric::extend(const std::vector<char>& is_held, Points& u, const Workers& workers, const Points* forces,
                    bool is_refined) const {
  Points b = Points::Zero(u.rows(), 3);
  for (std::int32_t i = 0; i < shape_->vertex_count(); ++i) {
    if (is_held[i]) {
      b.row(i) = u.row(i);
      continue;
    }
    if (forces != nullptr) b.row(i) = forces->row(i) / scale_;
    for (std::int32_t k = shape_->offsets()[i]; k < shape_->offsets()[i + 1]; ++k) {
      const std::int32_t j = shape_->neighbours()[k];
      if (is_held[j]) b.row(i) += edge_weight(i, k) * u.row(j);
    }
  }
  single().solve(b, u, workers);
  for (std::int32_t i = 0; i < shape_->vertex_count(); ++i) {
    if (is_held[i]) u.row(i) = b.row(i);
  }
  if (!is_refined) return;
  subtract_product(u, b);  // 0 at held vertices
  single().solve(b, b, workers);
  u += b;
}

/// b -= matrix_ x.
void Metric::subtract_product(const Points& x, Points& b) const {
  for (std::int32_t j = 0; j < matrix_.size(); ++j) {
    for (std::int32_t entry = matrix_.columns[j]; entry < matrix_.columns[j + 1]; ++entry) {
      const std::int32_t i = matrix_.rows[entry];
      b.row(i) -= matrix_.values[entry] * x.row(j);
      if (i != j) b.row(j) -= matrix_.values[entry] * x.row(i);
    }
  }
}

const SingleFactor& Metric::single() const {
  if (single_.empty()) factor_.copy_to(single_);
  return single_;
}

void Metric::solve(const Points& b, Points& x) const {
  factor_.solve(b, x);
  x /= scale_;
}

void Metric::precondition(const Points& b, Points& x, const Workers& workers) const {
  single().solve(b, x, workers, 1 / scale_);
}

std::size_t Metric::memory_bytes() const {
  return factor_.memory_bytes() + single_.memory_bytes() + cell_weights_.capacity() * sizeof(double) +
         is_held_.capacity() + entries_.capacity() * sizeof(MatrixEntry) +
         matrix_.columns.capacity() * sizeof(std::int32_t) +
         matrix_.rows.capacity() * (sizeof(std::int32_t) + sizeof(double));
}

}  // namespace lpdeform
