#pragma once

#include <vector>

#include "core/base/workers.h"
#include "core/energy/rest_shape.h"
#include "core/linalg/cholesky.h"

namespace lpdeform {

/// A number to be added to a symmetric matrix at (row, column) and (column, row); row >= column.
struct MatrixEntry {
  std::int32_t row, column;
  double value;

  bool operator==(const MatrixEntry&) const = default;
};

/// The Hessian of the objective with its rotations and cell weights c held, on the free vertices:
///
///   M = 2 * Laplacian with edge weights (c_i + c_j) w_ij + entries,     held vertices are identity rows
///
/// with the entries that soft terms add (SoftTerms::matrix_entries): one scalar matrix for all three coordinates. For p = 2 it is exact (the matrix of local_global); for other
/// p it is what iteratively reweighted least squares would use. Ordering and symbolic analysis are made once,
/// by the constructor; factor() is numeric alone.
class Metric {
 public:
  static constexpr double kLowestShare = 1e-8;

  explicit Metric(std::shared_ptr<const RestShape> shape);

  /// `is_held` has one entry a vertex. Cell weights are clipped from below at 1e-8 of the largest used, so
  /// that the factorisation stays healthy where cells have no weight. False where the factorisation fails. A
  /// factor for the same held vertices, cell weights and entries, up to a common factor, is kept. `entries`
  /// form a positive semidefinite matrix; those of vertices that no edge joins go to the diagonal.
  [[nodiscard]] bool factor(const std::vector<double>& cell_weights, const std::vector<char>& is_held,
                            const std::vector<MatrixEntry>& entries = {});

  /// Keeps the last factor for these cell weights as well, scaled to them on the whole: for a metric that need
  /// not be exact. After is_factored_for().
  void adopt(const std::vector<double>& cell_weights);

  /// The last factor() was for these held vertices and succeeded.
  bool is_factored_for(const std::vector<char>& is_held) const { return is_good_ && is_held == is_held_; }

  /// x = M^-1 b; b is zero at held vertices.
  void solve(const Points& b, Points& x) const;

  /// The same to single precision, several times as fast.
  void precondition(const Points& b, Points& x, const Workers& workers) const;

  /// Extends the displacements of held vertices (their rows of u) to the free ones: the minimiser of
  /// sum over edges of (c_i + c_j) w_ij |u_i - u_j|^2, to about 1e-12; to single precision, in half the
  /// time, without `is_refined`. Rows of free vertices are overwritten. `forces`, where not null, pull
  /// at the free vertices besides: the entries count as well, and <forces, u> is subtracted.
  void extend(const std::vector<char>& is_held, Points& u, const Workers& workers,
              const Points* forces = nullptr, bool is_refined = true) const;

  /// c_i as factored, clipped.
  double cell_weight(std::int32_t i) const { return scale_ * cell_weights_[i]; }

  /// Changes with every numeric factorisation; 0 before the first.
  std::uint64_t version() const { return version_; }
  /// The common factor of M that adopt() changes: scale() M^-1 is one matrix for a version.
  double scale() const { return scale_; }

  std::size_t memory_bytes() const;

 private:
  double edge_weight(std::int32_t i, std::int32_t k) const {
    return 2 * (cell_weights_[i] + cell_weights_[shape_->neighbours()[k]]) * shape_->weights()[k];
  }
  void add_entry(const MatrixEntry& entry);
  const SingleFactor& single() const;
  void subtract_product(const Points& x, Points& b) const;

  std::shared_ptr<const RestShape> shape_;
  std::vector<double> cell_weights_;  // clipped, over scale_
  std::vector<char> is_held_;
  std::vector<MatrixEntry> entries_;  // over scale_
  double scale_ = 1;                  // the largest cell weight: M = scale_ * matrix_ on the free vertices
  bool is_good_ = false;
  std::uint64_t version_ = 0;
  LowerMatrix matrix_;
  SparseCholesky factor_;
  mutable SingleFactor single_;  // made when first asked for, empty until then
};

}  // namespace lpdeform
