#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/geometry.h"
#include "core/constraints/metric.h"
#include "core/energy/lp_norm.h"

namespace lpdeform {

/// A point that moves with up to three vertices: sum_j coefficients[j] x_{vertices[j]}.
struct PointForm {
  std::int32_t count = 1;
  std::array<std::int32_t, 3> vertices{};
  std::array<double, 3> coefficients{1, 0, 0};

  Eigen::RowVector3d at(const Points& x) const {
    Eigen::RowVector3d point = coefficients[0] * x.row(vertices[0]);
    for (std::int32_t j = 1; j < count; ++j) point += coefficients[j] * x.row(vertices[j]);
    return point;
  }
  bool operator==(const PointForm&) const = default;
};

/// Appends the entries of factor * b b^T, where b holds the coefficients.
void add_square(const PointForm& point, double factor, std::vector<MatrixEntry>& entries);

/// One row of a soft term: it pulls the point to `target` (scaled units).
struct SoftRow {
  PointForm point;
  Eigen::RowVector3d target;
  double weight = 1;
};

/// The terms of soft and orientation handles, which are added to the cells' energy. Each term k has a few rows r:
///
///   D_k^2       = sum_r w_r |point_r(x) - t_r|^2
///   soft_k      = s_a l^p (D_k / l)^{max(p, 2)}          p = p_a and s_a are those of its anchor vertex a
///
/// in the units of the energy (Eq. 3). For p >= 2 a term is like a cell's, with D_k in place of E_i, so the balance
/// between surface and soft handles does not depend on how far things move. For p < 2 the term is a spring (power 2),
/// since a power below 2 would either hold the point or not pull it at all. l is the length unit of the material. The
/// result does not depend on the unit of length or on a common factor of all stiffness values. Serial: the same bits on
/// any number of threads.
class SoftTerms {
 public:
  SoftTerms() = default;
  /// `length_unit` > 0: l in scaled units.
  explicit SoftTerms(double length_unit) : length_unit_(length_unit) {}
  void set_length_unit(double length_unit) { length_unit_ = length_unit; }

  /// Adds a term. `rows`: at least one, with weights >= 0.
  void add(std::int32_t anchor, const std::vector<SoftRow>& rows);

  bool empty() const { return anchors_.empty(); }
  std::size_t size() const { return anchors_.size(); }

  /// sum_k soft_k at x, in the units of the norm's sum.
  double evaluate(const Points& x, const LpNorm& norm);
  /// The same for another norm at the x of the last evaluation; add_gradient() and matrix_entries() then use that norm.
  double reweigh(const LpNorm& norm);
  /// The same; changes nothing.
  double sum(const LpNorm& norm) const;
  /// Adds the gradient at the x and norm of the last evaluation.
  void add_gradient(Points& result) const;

  /// The terms' contribution to the Hessian, with c_k = d soft_k / d D_k^2 held fixed: 2 c_k w_r b_i b_j.
  std::vector<MatrixEntry> matrix_entries() const { return matrix_entries(c_); }
  /// The same for given c_k.
  std::vector<MatrixEntry> matrix_entries(const std::vector<double>& weights) const;

  /// Whether `other` differs only in its targets.
  bool has_rows_of(const SoftTerms& other) const;
  /// Adds the change of pull from the targets of `before` to these targets, 2 c_k w_r b_j (t - t_before). `before` has
  /// the same rows; c_k are its weights.
  void add_pull(const SoftTerms& before, Points& forces) const;

  // Of the last evaluation.
  const std::vector<double>& squared_distances() const { return d2_; }  // D_k^2
  const std::vector<double>& weights() const { return c_; }             // c_k

  // Rows offsets[k] to offsets[k + 1] - 1 belong to term k.
  const std::vector<SoftRow>& rows() const { return rows_; }
  const std::vector<std::int32_t>& offsets() const { return offsets_; }
  std::int32_t anchor(std::size_t k) const { return anchors_[k]; }

  /// soft_k = coefficient D^exponent, for the norm without smoothing.
  double exponent(std::size_t k, const LpNorm& norm) const { return std::max(norm.p(anchors_[k]), 2.0); }
  double coefficient(std::size_t k, const LpNorm& norm) const;

 private:
  LpNorm::Term term(std::size_t k, const LpNorm& norm) const;

  double length_unit_ = 1;
  std::vector<SoftRow> rows_;
  std::vector<std::int32_t> offsets_{0};
  std::vector<std::int32_t> anchors_;
  std::vector<double> d2_, c_;
  Points residuals_;
};

}  // namespace lpdeform
