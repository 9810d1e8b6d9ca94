#pragma once

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
/// with the entries that soft terms add (SoftTerms::matrix_entries): one scalar matrix for all three coordinates.
/// For p = 2 it is exact (the matrix of local_global); for other p it is what iteratively reweighted least squares
/// would use. Ordering and symbolic analysis are made once,
/// by the constructor; factor() is numeric alone.
class Metric {
 public:
  static constexpr double kLowestShare = 1e-8;

  /// What a factorisation is for.
  enum class Precision {
    kSingle,  // precondition() above all: several times as fast, half the memory
    kDouble,  // solve() above all
  };

  /// Asked with the bytes that something is about to take, before it does; an error keeps it from doing so.
  using Admission = std::function<absl::Status(std::size_t bytes)>;

  /// Errors: FACTOR_TOO_LARGE (analyse_supernodes), and those of `admit`, which is asked with about what memory_bytes() will be
  /// in single precision. Without supernodes it is asked with what a triangulated surface needs.
  static absl::StatusOr<Metric> create(std::shared_ptr<const RestShape> shape, const Admission& admit = {});

  /// `is_held` has one entry a vertex. Cell weights are clipped from below at 1e-8 of the largest used, so
  /// that the factorisation stays healthy where cells have no weight. False where the factorisation fails. A
  /// factor for the same held vertices, cell weights and entries, up to a common factor, is kept. `entries`
  /// form a positive semidefinite matrix; those of vertices that no edge joins go to the diagonal. Where
  /// single precision does not carry the matrix, double is used. The same bits on any number of threads.
  [[nodiscard]] bool factor(const std::vector<double>& cell_weights, const std::vector<char>& is_held,
                            const std::vector<MatrixEntry>& entries, const Workers& workers,
                            Precision precision = Precision::kSingle);

  /// Keeps the last factor for these cell weights as well, scaled to them on the whole: for a metric that need
  /// not be exact. After is_factored_for().
  void adopt(const std::vector<double>& cell_weights);

  /// The last factor() was for these held vertices and succeeded.
  bool is_factored_for(const std::vector<char>& is_held) const { return is_good_ && is_held == is_held_; }

  /// x = M^-1 b to about 1e-12; b is zero at held vertices. From a factor in single precision by refinement. Not
  /// a number where no factor has these digits.
  void solve(const Points& b, Points& x, const Workers& workers) const;

  /// x = M^-1 b as well as single precision has it, always the same matrix for a version() and scale().
  void precondition(const Points& b, Points& x, const Workers& workers) const;

  /// Extends the displacements of held vertices (their rows of u) to the free ones: the minimiser of
  /// sum over edges of (c_i + c_j) w_ij |u_i - u_j|^2, as well as single precision has it. Rows of free vertices are overwritten. `forces`, where not null, pull
  /// at the free vertices besides: the entries count as well, and <forces, u> is subtracted.
  void extend(const std::vector<char>& is_held, Points& u, const Workers& workers,
              const Points* forces = nullptr) const;

  /// c_i as factored, clipped.
  double cell_weight(std::int32_t i) const { return scale_ * cell_weights_[i]; }

  /// Changes with every numeric factorisation; 0 before the first.
  std::uint64_t version() const { return version_; }
  /// The common factor of M that adopt() changes: scale() M^-1 is one matrix for a version.
  double scale() const { return scale_; }

  /// Back-substitutions for three right-hand sides so far.
  int back_substitutions() const { return back_substitutions_; }

  std::size_t memory_bytes() const;

 private:
  Metric(std::shared_ptr<const RestShape> shape, LowerMatrix matrix,
         const std::optional<SupernodePattern>& supernodes);
  double edge_weight(std::int32_t i, std::int32_t k) const {
    return 2 * (cell_weights_[i] + cell_weights_[shape_->neighbours()[k]]) * shape_->weights()[k];
  }
  void add_entry(const MatrixEntry& entry);
  void fill_matrix(const Workers& workers);
  bool factor_double() const;
  bool refine(const Points& b, Points& x, const Workers& workers) const;
  void solve_single(const Points& b, Points& x, const Workers& workers, double factor = 1) const;
  void solve_scaled(const Points& b, Points& x, const Workers& workers) const;
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
  std::optional<SingleCholesky> single_;      // none where the backend has no supernodes
  Precision precision_ = Precision::kSingle;  // that was asked for
  bool is_single_current_ = false;
  mutable std::optional<SparseCholesky> double_;  // made when first needed
  mutable bool is_double_current_ = false;
  mutable SingleFactor copy_;  // of double_, made when first needed, empty until then
  mutable int back_substitutions_ = 0;
};

}  // namespace lpdeform
