#include "core/constraints/soft_terms.h"

#include <algorithm>
#include <cmath>

namespace lpdeform {

void add_square(const PointForm& point, double factor, std::vector<MatrixEntry>& entries) {
  for (std::int32_t i = 0; i < point.count; ++i) {
    for (std::int32_t j = 0; j <= i; ++j) {
      entries.push_back({std::max(point.vertices[i], point.vertices[j]),
                         std::min(point.vertices[i], point.vertices[j]),
                         factor * point.coefficients[i] * point.coefficients[j]});
    }
  }
}

void SoftTerms::add(std::int32_t anchor, const std::vector<SoftRow>& rows) {
  rows_.insert(rows_.end(), rows.begin(), rows.end());
  offsets_.push_back(static_cast<std::int32_t>(rows_.size()));
  anchors_.push_back(anchor);
  d2_.push_back(0);
  c_.push_back(0);
}

double SoftTerms::coefficient(std::size_t k, const LpNorm& norm) const {
  const double p = norm.p(anchors_[k]), coefficient = norm.coefficient(anchors_[k]);
  return p < 2 ? coefficient * std::pow(length_unit_, p - 2) : coefficient;
}

LpNorm::Term SoftTerms::term(std::size_t k, const LpNorm& norm) const {
  if (norm.p(anchors_[k]) >= 2) return norm.term(anchors_[k], d2_[k]);
  const double stiffness = coefficient(k, norm);
  return {stiffness * d2_[k], stiffness};
}

double SoftTerms::evaluate(const Points& x, const LpNorm& norm) {
  residuals_.resize(static_cast<Eigen::Index>(rows_.size()), 3);
  for (std::size_t k = 0; k < size(); ++k) {
    d2_[k] = 0;
    for (std::int32_t r = offsets_[k]; r < offsets_[k + 1]; ++r) {
      residuals_.row(r) = rows_[r].point.at(x) - rows_[r].target;
      d2_[k] += rows_[r].weight * residuals_.row(r).squaredNorm();
    }
  }
  return reweigh(norm);
}

double SoftTerms::reweigh(const LpNorm& norm) {
  double sum = 0;
  for (std::size_t k = 0; k < size(); ++k) {
    const LpNorm::Term value = term(k, norm);
    c_[k] = value.weight;
    sum += value.value;
  }
  return sum;
}

double SoftTerms::sum(const LpNorm& norm) const {
  double sum = 0;
  for (std::size_t k = 0; k < size(); ++k) sum += term(k, norm).value;
  return sum;
}

void SoftTerms::add_gradient(Points& result) const {
  for (std::size_t k = 0; k < size(); ++k) {
    for (std::int32_t r = offsets_[k]; r < offsets_[k + 1]; ++r) {
      const PointForm& point = rows_[r].point;
      const double factor = 2 * c_[k] * rows_[r].weight;
      for (std::int32_t j = 0; j < point.count; ++j) {
        result.row(point.vertices[j]) += factor * point.coefficients[j] * residuals_.row(r);
      }
    }
  }
}

bool SoftTerms::has_rows_of(const SoftTerms& other) const {
  if (offsets_ != other.offsets_ || anchors_ != other.anchors_) return false;
  return std::equal(rows_.begin(), rows_.end(), other.rows_.begin(), [](const SoftRow& a, const SoftRow& b) {
    return a.point == b.point && a.weight == b.weight;
  });
}

void SoftTerms::add_pull(const SoftTerms& before, Points& forces) const {
  for (std::size_t k = 0; k < size(); ++k) {
    for (std::int32_t r = offsets_[k]; r < offsets_[k + 1]; ++r) {
      const PointForm& point = rows_[r].point;
      const Eigen::RowVector3d pull =
          2 * before.c_[k] * rows_[r].weight * (rows_[r].target - before.rows_[r].target);
      for (std::int32_t j = 0; j < point.count; ++j) {
        forces.row(point.vertices[j]) += point.coefficients[j] * pull;
      }
    }
  }
}

std::vector<MatrixEntry> SoftTerms::matrix_entries(const std::vector<double>& weights) const {
  std::vector<MatrixEntry> entries;
  for (std::size_t k = 0; k < size(); ++k) {
    for (std::int32_t r = offsets_[k]; r < offsets_[k + 1]; ++r) {
      add_square(rows_[r].point, 2 * weights[k] * rows_[r].weight, entries);
    }
  }
  return entries;
}

}  // namespace lpdeform
