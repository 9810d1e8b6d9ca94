#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/workers.h"
#include "core/energy/rest_shape.h"
#include "core/linalg/cholesky.h"
#include "core/linalg/single_cholesky.h"

namespace lpdeform {

/// A number to add to a symmetric matrix at (row, column) and (column, row); row >= column.
struct MatrixEntry {
  std::int32_t row, column;
  double value;

  bool operator==(const MatrixEntry&) const = default;
};

/// The Hessian of the objective with rotations and cell weights c held fixed, on the free vertices: a reweighted
/// Laplacian
///
///   M = 2 * Laplacian with edge weights (c_i + c_j) w_ij + entries,     held vertices are identity rows
///
/// `entries` are those that soft terms add (SoftTerms::matrix_entries). One scalar matrix serves all three coordinates.
/// For p = 2 it is exact (the matrix of local_global); for other p it is the matrix of iteratively reweighted least
/// squares. create() does ordering and symbolic analysis once; factor() is the numeric phase only.
class Metric {
 public:
  static constexpr double kLowestShare = 1e-8;

  /// What a factorisation is for.
  enum class Precision {
    kSingle,  // mainly for precondition(): several times as fast, half the memory
    kDouble,  // mainly for solve()
  };

  /// Admission control: called with the number of bytes before they are allocated. If it returns an error, they are
  /// not.
  using Admission = std::function<absl::Status(std::size_t bytes)>;

  /// The most multiplications that a factorisation for n vertices may take (operation_count), because nothing can interrupt one. A
  /// surface of a million vertices takes some 4e10, of four million 3e11; 36,000 vertices in faces at random take 2e12.
  static double most_operations(std::int32_t n) { return std::max(5e11, 2e5 * n); }

  /// Errors: FACTOR_TOO_LARGE (analyse_supernodes, most_operations), and those of `admit`, which is called with an estimate of
  /// memory_bytes() in single precision.
  static absl::StatusOr<Metric> create(std::shared_ptr<const RestShape> shape, const Admission& admit = {});

  /// `is_held` has one entry per vertex. Cell weights are clipped from below at 1e-8 of the largest, so that the
  /// factorisation stays well conditioned if some cells have no weight. False if the factorisation fails. The present
  /// factor is kept if held vertices, precision and, up to a common factor, cell weights and entries are the same.
  /// `entries` form a positive semidefinite matrix; entries of vertex pairs without an edge go to the diagonal. If the
  /// matrix cannot be factored in single precision, double is used; memory_bytes() is then two to four times as high. The same bits on any
  /// number of threads.
  [[nodiscard]] bool factor(const std::vector<double>& cell_weights, const std::vector<char>& is_held,
                            const std::vector<MatrixEntry>& entries, const Workers& workers,
                            Precision precision = Precision::kSingle);

  /// From now on, factor() in single precision raises up to ten pivots that are zero to rounding (SingleCholesky::factor), before it takes
  /// double precision. The factor, and so precondition() and extend(), then belongs to M with a few larger diagonal entries. solve() stays as accurate.
  void raise_few_pivots() { most_raised_ = kMostRaised; }

  /// Keeps using the last factor for these cell weights, scaled so that the sums of the weights agree. For a metric
  /// that need not be exact. Requires is_factored_for().
  void adopt(const std::vector<double>& cell_weights);

  /// Frees the factor's values, most of memory_bytes(). Until the next factor(), is_factored_for() is false, and nothing may be solved.
  void release();
  /// What a factorisation in single precision allocates again after release(); 0 once there was one.
  std::size_t released_bytes() const { return single_.freed_bytes(); }

  /// Whether the last factor() was for these held vertices and succeeded, and its factor has not been released.
  bool is_factored_for(const std::vector<char>& is_held) const { return is_good_ && is_held == is_held_; }

  /// x = M^-1 b to a relative error of about 1e-12; b is zero at held vertices. With a factor in single precision, by
  /// iterative refinement. If no factor reaches this accuracy, x is NaN.
  void solve(const Points& b, Points& x, const Workers& workers) const;

  /// x = M^-1 b to single precision. The matrix is always the same for the same version() and scale().
  void precondition(const Points& b, Points& x, const Workers& workers) const;
  void precondition(const Points& b, SinglePoints& x, const Workers& workers) const;

  /// Extends the displacements of held vertices (their rows of u) to the free ones: the minimiser of the sum over edges
  /// of (c_i + c_j) w_ij |u_i - u_j|^2, to single precision. Rows of free vertices are overwritten. If `forces`, over scale(), are
  /// not empty, they also pull at the free vertices: the entries count as well, and <forces, u> is subtracted from the sum.
  void extend(const std::vector<char>& is_held, Points& u, const Workers& workers, Points forces = {}) const;

  /// c_i as factored, clipped.
  double cell_weight(std::int32_t i) const { return scale_ * cell_weights_[i]; }
  /// cell_weight() of all cells, over scale().
  const std::vector<double>& relative_cell_weights() const { return cell_weights_; }

  /// Changes with every numeric factorisation; 0 before the first.
  std::uint64_t version() const { return version_; }
  /// The common factor of M that adopt() changes: scale() M^-1 is one matrix for a version.
  double scale() const { return scale_; }

  /// Back-substitutions for three right-hand sides so far.
  int back_substitutions() const { return back_substitutions_; }

  std::size_t memory_bytes() const;

 private:
  static constexpr int kMostRaised = 10;

  /// A row of M / scale_.
  class Rows : public SymmetricRows {
   public:
    explicit Rows(const Metric& metric) : metric_(metric) {}
    void append_row(std::int32_t i, std::vector<Entry>& to) const override;

   private:
    const Metric& metric_;
  };

  Metric(std::shared_ptr<const RestShape> shape, const SupernodePattern& supernodes);
  void index_entries();
  double edge_weight(std::int32_t i, std::int32_t k) const {
    return 2 * (cell_weights_[i] + cell_weights_[shape_->neighbours()[k]]) * shape_->weights()[k];
  }
  void need_matrix() const;
  bool factor_double() const;
  bool refine(const Points& b, Points& x, const Workers& workers) const;
  template <typename Result>
  void solve_single(const Points& b, Result& x, const Workers& workers, double factor = 1) const {
    ++back_substitutions_;
    single().solve(b, x, workers, factor);
  }
  void solve_scaled(const Points& b, Points& x, const Workers& workers) const;
  const SingleFactor& single() const;
  void subtract_product(const Points& x, Points& b) const;

  std::shared_ptr<const RestShape> shape_;
  std::vector<double> cell_weights_;  // clipped, over scale_
  std::vector<char> is_held_;
  std::vector<MatrixEntry> entries_;  // over scale_
  std::vector<MatrixEntry> by_row_;   // the same, those off the diagonal both ways round, sorted by row
  double scale_ = 1;                  // the largest cell weight: M = scale_ * matrix_ on the free vertices
  bool is_good_ = false;
  std::uint64_t version_ = 0;
  mutable LowerMatrix matrix_;  // see need_matrix()
  SingleCholesky single_;
  int most_raised_ = 0;
  Precision precision_ = Precision::kSingle;  // the requested one
  bool is_single_current_ = false;
  mutable std::optional<SparseCholesky> double_;  // made when first needed
  mutable bool is_double_current_ = false;
  mutable SingleFactor copy_;  // of double_; empty until first needed
  mutable int back_substitutions_ = 0;
};

}  // namespace lpdeform
