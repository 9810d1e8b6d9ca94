#pragma once

#include <optional>
#include <vector>

#include "core/linalg/cholesky.h"
#include "core/methods/minimiser.h"
#include "core/methods/residuals.h"

namespace lpdeform {

/// The convex step of p = 1 as a second-order cone program (Eq. 11, the root of w_ij over the whole
/// difference):
///
///   minimise sum_i k_i T_i   subject to   T_i >= |z_i|,  z = A x - b
///
/// with the rotations held and k_i the norm's coefficients, by a primal-dual interior-point method with Nesterov-Todd scaling and Mehrotra's predictor-corrector (as
/// in Vandenberghe, "The CVXOPT linear and quadratic cone program solvers", 2010). The dual cone variables
/// are (k_i, w_i) with A^T w = 0. It starts strictly feasible on both sides (T_i > |z_i| and w = 0) and stays
/// so: each iterate has a primal value and a lower bound. A 3n x 3n system on the two-ring pattern is
/// factored in each iteration, with the T_i eliminated.
class ConicStep {
 public:
  /// `rotations` are held; `x` is the initial guess.
  ConicStep(const Problem& problem, std::vector<Eigen::Matrix3d> rotations, const Points& x);

  /// One iteration. False where none is possible any more: the factorisation failed or the step vanished.
  bool iterate();

  const Points& x() const { return x_; }
  double primal() const { return primal_; }            // sum_i k_i |z_i(x)|
  double lower_bound() const { return lower_bound_; }  // best dual value so far: no x has a smaller sum
  /// (primal - lower bound) / primal; 0 where primal is 0 to rounding.
  double relative_gap() const;

 private:
  /// A point of the product of cones, or a direction in it.
  struct Cones {
    std::vector<double> head;  // one a cell
    EdgeVectors tail;          // z_i or w_i by rows of the cell
  };
  /// Nesterov-Todd scaling of one cone, with (u, v) = w bar and u^2 - |v|^2 = 1:
  ///   W = eta [u, v^T; v, I + v v^T / (1 + u)].
  struct Scaling {
    double eta = 1, u = 1;
  };

  void scale_cones();
  void assemble();
  bool direction(const Cones& target, Points& dx, Cones& ds, Cones& dw);
  Cones complementarity() const;  // lambda o lambda
  void correct(const Cones& ds, const Cones& dw, double centre, Cones& target) const;
  double step_length(const Cones& point, const Cones& direction) const;
  void update_bounds();
  Points apply_schur(const Points& dx) const;

  const RestShape& shape() const { return problem_.shape(); }
  auto rows(EdgeVectors& values, std::int32_t cell) const {
    return values.middleRows(shape().offsets()[cell], shape().offsets()[cell + 1] - shape().offsets()[cell]);
  }
  auto rows(const EdgeVectors& values, std::int32_t cell) const {
    return values.middleRows(shape().offsets()[cell], shape().offsets()[cell + 1] - shape().offsets()[cell]);
  }

  Problem problem_;
  std::vector<Eigen::Matrix3d> rotations_;
  std::vector<std::int32_t> cells_;  // those with a free vertex; the others are constant
  std::vector<std::int32_t> free_;   // vertex -> index among the free ones, -1 where held
  Points x_;
  Cones s_, w_;  // (T, z) and (k, w)
  std::vector<Scaling> scaling_;
  EdgeVectors v_;  // tails of w bar
  Cones lambda_;   // W w = W^-1 s
  double primal_ = 0, constant_ = 0, lower_bound_ = 0;
  LowerMatrix matrix_;
  std::optional<SparseCholesky> factor_;
};

}  // namespace lpdeform
