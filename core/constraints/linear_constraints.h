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

/// Equations C x = t that points inside faces and locks put on the positions of vertices that are not held
/// altogether. Exact: a state that satisfies them keeps to them along every direction that restrict() leaves,
/// and the metric's inverse on those directions,
///
///   P = M^-1 - M^-1 C^T (C M^-1 C^T)^-1 C M^-1 ,
///
/// takes the place of M^-1 (project). C M^-1 C^T is small and dense; it is made once for each factor of the metric, by
/// one back-substitution for each three points, and a solve costs two instead of one. Without rows everything
/// here costs nothing. One caller at a time.
class LinearConstraints {
 public:
  LinearConstraints() = default;

  /// Errors, INVALID_ARGUMENT: TOO_MANY_LOCKS (over kMostRows rows); HANDLE_CONSTRAINTS_DEPENDENT where a row
  /// follows from other rows and held vertices, or contradicts them: names both handles.
  static absl::StatusOr<LinearConstraints> create(std::vector<LinearRow> rows,
                                                  const std::vector<char>& is_held);

  bool empty() const { return rows_.empty(); }
  const std::vector<LinearRow>& rows() const { return rows_; }

  /// Subtracts from v, zero at held vertices, the least that makes C v = 0.
  void restrict(Points& v) const;
  /// Moves x, its free vertices alone, by the least that makes C x = t.
  void satisfy(Points& x) const;
  /// The same by the least in the metric: a lock's or point's move spreads over the surface.
  void satisfy_within(const Metric& metric, Points& x, const Workers& workers) const;

  /// Makes P b of v = M^-1 b, given a function that makes M^-1 v of v.
  template <typename Solve>
  void project(const Metric& metric, const Solve& solve, Points& v, const Workers& workers) const {
    if (empty()) return;
    Points forces = forces_against(metric, v, workers);
    solve(forces);
    v -= forces;
    restrict(v);
  }

  /// Entries that tie points to where they are, `stiffness` each: they make the metric definite where points
  /// alone hold a component, and change nothing along directions that the rows allow. Locked vertices are tied
  /// only after tie_locks(), where they alone hold a component: there the metric is stiffer than it should be.
  void add_ties(double stiffness, std::vector<MatrixEntry>& entries) const;
  void tie_locks() { has_tied_locks_ = true; }
  bool has_tied_locks() const { return has_tied_locks_; }

  /// Takes over the factorisations of `before` where its rows differ in their targets alone; false elsewhere.
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
