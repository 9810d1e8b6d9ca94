#pragma once

#include "core/methods/minimiser.h"
#include "core/methods/residuals.h"

namespace lpdeform {

/// The convex problem for the whole objective with rotations held fixed. The index i runs over the cells and then over
/// the soft terms:
///
///   minimise sum_i coefficient_i |z_i|^{exponent_i},     z = A x - b,
///
/// over the x that the constraints allow. z_i holds a cell's stacked residuals (residuals.h), or a soft term's
/// residuals sqrt(w_r) (point_r(x) - t_r). Refers to `problem`, whose objective holds the evaluation at x.
class ConvexRows {
 public:
  explicit ConvexRows(const Problem& problem)
      : problem_(problem), shape_(problem.shape()), soft_(problem.objective.soft_terms()) {}

  /// The number of cells and soft terms.
  std::int32_t count() const { return shape_.vertex_count() + static_cast<std::int32_t>(soft_.size()); }
  double exponent(std::int32_t i) const;
  double coefficient(std::int32_t i) const;

  /// The rows of `values` that belong to cell or term i.
  auto rows(EdgeVectors& values, std::int32_t i) const {
    return values.middleRows(begin(i), end(i) - begin(i));
  }
  double norm(const EdgeVectors& values, std::int32_t i) const {
    return values.middleRows(begin(i), end(i) - begin(i)).norm();
  }

  /// z at x.
  void residuals(const Points& x, EdgeVectors& z) const;
  /// A u.
  void apply(const Points& u, EdgeVectors& result) const;
  /// A^T y, with the directions that constraints forbid projected out.
  void apply_transposed(const EdgeVectors& y, Points& result) const;

  /// Factors the metric M = 2 A^T C A along the directions that the constraints allow. C holds the weights of the
  /// objective's last evaluation, or the given ones, count() of them. False if that fails.
  [[nodiscard]] bool factor();
  [[nodiscard]] bool factor(const std::vector<double>& weights);
  /// C of cell or term i, as last factored.
  double weight(std::int32_t i) const;

 private:
  std::int32_t edges() const { return shape_.offsets().back(); }
  Eigen::Index begin(std::int32_t i) const;
  Eigen::Index end(std::int32_t i) const { return begin(i + 1); }

  const Problem& problem_;
  const RestShape& shape_;
  const SoftTerms& soft_;
  std::vector<double> soft_weights_;  // C of the soft terms, as last factored
};

}  // namespace lpdeform
