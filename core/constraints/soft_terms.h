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

/// The entries of factor * b b^T, b the coefficients.
void add_square(const PointForm& point, double factor, std::vector<MatrixEntry>& entries);

/// One wish of a soft term: that the point be at `target` (scaled units).
struct SoftRow {
  PointForm point;
  Eigen::RowVector3d target;
  double weight = 1;
};

/// What is wished for beside the cells' rigidity, each term k a few rows r:
///
///   D_k^2       = sum_r w_r |point_r(x) - t_r|^2
///   soft_k      = s_a l^p (D_k / l)^{max(p, 2)}          p = p_a and s_a those of its anchor, a vertex
///
/// in the units of the energy (Eq. 3): for p >= 2 a term is a cell like any other, with D_k for E_i, so that
/// how far surface and wishes give way to each other does not depend on how far things move; for p < 2 it is
/// a spring, since a power below 2 would either hold or let go, with nothing between. l is the length unit of
/// the material. Neither the unit of length nor a common factor of all stiffness matters. Serial: the same
/// bits on any number of threads.
class SoftTerms {
 public:
  SoftTerms() = default;
  /// `length_unit` > 0: l in scaled units.
  explicit SoftTerms(double length_unit) : length_unit_(length_unit) {}
  void set_length_unit(double length_unit) { length_unit_ = length_unit; }

  /// Rows of weight >= 0, at least one.
  void add(std::int32_t anchor, const std::vector<SoftRow>& rows);

  bool empty() const { return anchors_.empty(); }
  std::size_t size() const { return anchors_.size(); }

  /// sum_k soft_k at x, in the units of the norm's sum.
  double evaluate(const Points& x, const LpNorm& norm);
  /// The same for another norm at the x of the last evaluation; gradient() and matrix_entries() follow it.
  double reweigh(const LpNorm& norm);
  /// The same; changes nothing.
  double sum(const LpNorm& norm) const;
  /// Adds the gradient at the x and norm of the last evaluation.
  void add_gradient(Points& result) const;

  /// What the terms add to the Hessian with c_k = d soft_k / d D_k^2 held: 2 c_k w_r b_i b_j.
  std::vector<MatrixEntry> matrix_entries() const { return matrix_entries(c_); }
  /// The same for given c_k.
  std::vector<MatrixEntry> matrix_entries(const std::vector<double>& weights) const;

  /// Whether `other` differs in its targets alone.
  bool has_rows_of(const SoftTerms& other) const;
  /// Adds what these targets pull more than those of `before`, which has the same rows, in its weights c_k:
  /// 2 c_k w_r b_j (t - t_before).
  void add_pull(const SoftTerms& before, Points& forces) const;

  // Of the last evaluation.
  const std::vector<double>& squared_distances() const { return d2_; }  // D_k^2
  const std::vector<double>& weights() const { return c_; }             // c_k

  // Rows offsets[k] to offsets[k + 1] belong to term k.
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
