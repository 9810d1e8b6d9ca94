#pragma once

#include <optional>
#include <vector>

#include "core/linalg/cholesky.h"
#include "core/methods/minimiser.h"
#include "core/methods/residuals.h"

namespace lpdeform {

/// The convex step of p = 1 as a second-order cone program (Eq. 11, with the root of w_ij applied to the whole
/// difference):
///
///   minimise sum_i k_i T_i   subject to   T_i >= |z_i|,  z = A x - b
///
/// with rotations held fixed; k_i are the norm's coefficients. It is solved by a primal-dual interior-point method with
/// Nesterov-Todd scaling and Mehrotra's predictor-corrector (as in Vandenberghe, "The CVXOPT linear and quadratic cone
/// program solvers", 2010). The dual cone variables are (k_i, w_i) with A^T w = 0. The method starts strictly feasible,
/// both primal (T_i > |z_i|) and dual (w = 0), and stays so: each iterate has a primal value and a lower bound. Each
/// iteration eliminates the T_i and factors a 3n x 3n system on the two-ring pattern.
class ConicStep {
 public:
  /// `rotations` are held fixed; `x` is the initial guess.
  ConicStep(const Problem& problem, std::vector<Eigen::Matrix3d> rotations, const Points& x);

  /// Makes one iteration. False if no further iteration is possible: the factorisation failed or the step vanished.
  bool iterate();

  const Points& x() const { return x_; }
  double primal() const { return primal_; }            // sum_i k_i |z_i(x)|
  double lower_bound() const { return lower_bound_; }  // the best dual value so far; no x has a smaller sum
  /// The relative duality gap (primal - lower bound) / primal; 0 if primal is 0 to rounding.
  double relative_gap() const;

 private:
  /// A point of the product of cones, or a direction in it.
  struct Cones {
    std::vector<double> head;  // one per cell
    EdgeVectors tail;          // z_i or w_i in the rows of the cell
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
  std::vector<std::int32_t> cells_;  // cells with a free vertex; all others are constant
  std::vector<std::int32_t> free_;   // index of each vertex among the free ones; -1 if held
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
