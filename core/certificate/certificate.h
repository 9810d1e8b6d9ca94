#pragma once

#include <limits>
#include <memory>

#include "core/methods/minimiser.h"
#include "core/methods/residuals.h"

namespace lpdeform {

/// Bounds how far a state can be from the optimum of the convex problem in which its rotations are held fixed: the
/// relative duality gap (Fenchel duality). Let f_i(z_i) = k_i |z_i|^{p_i} be the terms of the norm, unsmoothed. Then
/// for any y with A^T y = 0 on the free vertices,
///
///   min over x of sum_i f_i(z_i(x))  >=  D(y) = <y, z> - sum_i f_i*(y_i)
///   f_i*(y_i) = (p_i - 1) k_i (|y_i| / (k_i p_i))^{p_i / (p_i - 1)}
///   for p_i = 1: f_i*(y_i) = 0 where |y_i| <= k_i, infinite elsewhere.
///
/// Soft terms are among the f_i (ConvexRows). If points and locks put equations C x = t on the positions, A^T y need
/// only be orthogonal to the x with C x = 0; the projection then uses the solve of LinearConstraints.
///
/// y starts as the gradient of the terms, projected by one solve with the reweighted Laplacian,
///
///   y - C A (A^T C A)^-1 A^T y,   C = diag of the cells' weights c_i,
///
/// and is scaled so that D is largest. If that bound is loose, y is polished by ADMM on the convex problem. Each cell
/// has a penalty proportional to its k_i, so that stiff and soft cells converge equally fast. The multipliers of ADMM
/// are feasible by construction and cost one back-substitution per step. ADMM starts from the best of several smoothed
/// gradients k_i p_i (|z_i|^2 + eps^2)^{p_i / 2 - 1} z_i.
struct CertificateSettings {
  double good_enough = 1e-4;  // polishing stops when the relative gap is <= this
  int max_steps = 1500;
  double max_seconds = std::numeric_limits<double>::infinity();
};

/// Computes the bound in steps of at most one factorisation or back-substitution each, so that a live session can stop
/// between steps.
class Certificate {
 public:
  /// `problem.objective` holds the evaluation at x, in `problem.norm`; `problem.metric` is refactored. Objects that
  /// `problem` refers to must not change before the last step.
  Certificate(Problem problem, const Points& x, const CertificateSettings& settings = {});
  ~Certificate();

  /// Makes one step. True while there is more to do. Ends early if the problem's stop is requested.
  bool step();

  /// The relative gap (P - D) / P at x, in [0, 1]. P is the sum of the norm's unsmoothed terms, D the best bound so
  /// far. 0 if P is 0. 1 if no bound was found, which includes a P that is not finite and components that only locks
  /// hold.
  double relative_gap() const;

 private:
  class Search;
  std::unique_ptr<Search> search_;
};

/// Makes all steps and returns the gap.
double relative_gap(const Problem& problem, const Points& x, const CertificateSettings& settings = {});

}  // namespace lpdeform
