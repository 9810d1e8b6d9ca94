#pragma once

#include <limits>
#include <memory>

#include "core/methods/minimiser.h"
#include "core/methods/residuals.h"

namespace lpdeform {

/// How far a state can be from the optimum of the convex problem with its rotations held (Fenchel duality).
/// With f_i(z_i) = k_i |z_i|^{p_i}, the true terms of the norm, and any y with A^T y = 0 on the free
/// vertices,
///
///   min over x of sum_i f_i(z_i(x))  >=  D(y) = <y, z> - sum_i f_i*(y_i)
///   f_i*(y_i) = (p_i - 1) k_i (|y_i| / (k_i p_i))^{p_i / (p_i - 1)}
///   for p_i = 1: f_i*(y_i) = 0 where |y_i| <= k_i, infinite elsewhere.
///
/// Soft terms are among the f_i (ConvexRows). Where points and locks put equations C x = t on the positions, A^T y
/// need only be orthogonal to the x with C x = 0: the projection's solve becomes that of LinearConstraints.
///
/// y begins as the gradient of the terms, projected by one solve with the reweighted Laplacian,
///
///   y - C A (A^T C A)^-1 A^T y,   C = the cells' weights c_i,
///
/// and is scaled so that D is largest. Where that bound is loose, y is polished by ADMM on the convex
/// problem, each cell with a penalty in proportion to its k_i, so that the stiffest and the softest converge alike. Its
/// multipliers are feasible by construction, at one back-substitution a step; it begins with
/// the best of several smoothed gradients k_i p_i (|z_i|^2 + eps^2)^{p_i / 2 - 1} z_i.
struct CertificateSettings {
  double good_enough = 1e-4;  // stop polishing at this relative gap
  int max_steps = 1500;
  double max_seconds = std::numeric_limits<double>::infinity();
};

/// The bound, in steps of at most one factorisation or back-substitution, so that a live session can leave
/// off between them.
class Certificate {
 public:
  /// `problem.objective` holds the evaluation at x, in `problem.norm`; `problem.metric` is refactored. What `problem`
  /// refers to must not change before the last step.
  Certificate(Problem problem, const Points& x, const CertificateSettings& settings = {});
  ~Certificate();

  /// True while there is more to do. Ends early where the problem's stop is requested.
  bool step();

  /// (P - D) / P at x in [0, 1], P the sum of the norm's unsmoothed terms and D the best bound so far; 0 where P is 0. 1
  /// where no bound was found, also because P is not finite, or where locks alone keep a component.
  double relative_gap() const;

 private:
  class Search;
  std::unique_ptr<Search> search_;
};

/// All steps at once.
double relative_gap(const Problem& problem, const Points& x, const CertificateSettings& settings = {});

}  // namespace lpdeform
