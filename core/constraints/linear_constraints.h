#pragma once

#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/constraints/metric.h"
#include "core/constraints/soft_terms.h"

namespace lpdeform {

/// direction . point(x) = target, in scaled units; `direction` has unit length.
struct LinearRow {
  PointForm point;
  Eigen::Vector3d direction;
  double target;
  std::string owner;  // the handle's name
};

/// Equations C x = t that points inside faces and locks put on the positions of vertices that are not held. They are
/// satisfied exactly: a state that satisfies them still does after a move along any direction that restrict() permits.
/// The metric's inverse on those directions,
///
///   P = M^-1 - M^-1 C^T (C M^-1 C^T)^-1 C M^-1 ,
///
/// replaces M^-1 (project). C M^-1 C^T is small and dense. It is computed once per factorisation of the metric, by one
/// back-substitution for every three points. A solve then costs two back-substitutions instead of one. Without rows,
/// nothing here costs anything. One caller at a time.
class LinearConstraints {
 public:
  LinearConstraints() = default;

  /// Errors, INVALID_ARGUMENT: TOO_MANY_LOCKS (over kMostRows rows; names the handle that has the most); HANDLE_CONSTRAINTS_DEPENDENT if a row follows from
  /// other rows and held vertices, or contradicts them; names both handles.
  static absl::StatusOr<LinearConstraints> create(std::vector<LinearRow> rows,
                                                  const std::vector<char>& is_held);

  bool empty() const { return rows_.empty(); }
  const std::vector<LinearRow>& rows() const { return rows_; }

  /// Subtracts from v, which is zero at held vertices, the smallest change (least squares) that makes C v = 0.
  void restrict(Points& v) const;
  /// Moves the free vertices of x by the smallest change (least squares) that makes C x = t.
  void satisfy(Points& x) const;
  /// The same with the smallest change in the metric, so that the move of a point or lock spreads over the surface.
  void satisfy_within(const Metric& metric, Points& x, const Workers& workers) const;

  /// Turns v = M^-1 b into P b. `solve` replaces its argument v by M^-1 v.
  template <typename Solve>
  void project(const Metric& metric, const Solve& solve, Points& v, const Workers& workers) const {
    if (empty()) return;
    Points forces = forces_against(metric, v, workers);
    solve(forces);
    v -= forces;
    restrict(v);
  }

  /// Adds matrix entries that tie points to their positions with this stiffness. They make the metric definite if only
  /// points hold a component, and change nothing along directions that the rows allow. Locked vertices are tied only
  /// after tie_locks(), which is for components that only locks hold; the metric is then stiffer than the true Hessian.
  void add_ties(double stiffness, std::vector<MatrixEntry>& entries) const;
  void tie_locks() { has_tied_locks_ = true; }
  bool has_tied_locks() const { return has_tied_locks_; }

  /// Takes over the factorisations of `before` if its rows differ only in their targets; otherwise false.
  bool reuse(const LinearConstraints& before);

  std::size_t memory_bytes() const;

  static constexpr std::size_t kMostRows = 1024;

 private:
  struct Factors;
  absl::Status factor();
  void prepare_schur(const Metric& metric, const Workers& workers) const;
  Eigen::VectorXd image(const Points& v) const;                 // C v, v zero at held vertices
  Eigen::VectorXd residual(const Points& x) const;              // t - C x
  Points transposed(const Eigen::VectorXd& multipliers) const;  // C^T lambda
  Points forces_against(const Metric& metric, const Points& v,
                        const Workers& workers) const;  // C^T (C M^-1 C^T)^-1 C v

  std::vector<LinearRow> rows_;
  std::vector<char> is_held_;
  bool has_tied_locks_ = false;
  std::shared_ptr<Factors> factors_;
};

}  // namespace lpdeform
