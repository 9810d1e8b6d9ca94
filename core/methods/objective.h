#pragma once

#include "core/constraints/soft_terms.h"
#include "core/energy/cell_pass.h"

namespace lpdeform {

/// The function that a method minimises: the cells' terms (CellPass) plus the terms of soft and orientation handles
/// (SoftTerms),
///
///   f(x) = sum_i term_i(E_i^2) + sum_k soft_k(D_k^2)
///
/// Without soft terms it equals the cell pass, bit for bit. Positions are in scaled units. One caller at a time.
class Objective {
 public:
  Objective(std::shared_ptr<const RestShape> shape, Workers workers)
      : cells_(std::move(shape), std::move(workers)) {}

  /// CellPass::set_bending.
  void set_bending(const Field& shares) { cells_.set_bending(shares); }
  void set_soft_terms(SoftTerms terms) { soft_ = std::move(terms); }

  /// f at x, all rotations fitted.
  double evaluate(const Points& x, const LpNorm& norm);
  /// f at x with the rotations of the last evaluate.
  double evaluate_held(const Points& x, const LpNorm& norm);
  /// f of another norm at the x of the last evaluation; gradient() and the weights then use that norm.
  double reweigh(const LpNorm& norm);
  /// f of another norm at the x of the last evaluation; changes nothing.
  double sum(const LpNorm& norm) const;
  /// The gradient at the x, norm and rotations of the last evaluation.
  void gradient(Points& result) const;
  /// CellPass::turning_forces.
  template <typename Motion>
  void turning_forces(const Motion& motion, const std::vector<double>& c, Points& forces) {
    cells_.turning_forces(motion, c, forces);
  }

  /// The cells' part and the soft terms' part of the last evaluation.
  const CellPass& cells() const { return cells_; }
  const SoftTerms& soft_terms() const { return soft_; }
  /// The soft terms' c_k of the last evaluation, for the metric. They are clipped from below at Metric::kLowestShare of
  /// the largest cell weight. This keeps the metric definite when the target of a term with p > 2 is reached exactly
  /// and nothing else holds the component.
  std::vector<double> soft_weights() const;

  /// Calls of evaluate() so far.
  int evaluations() const { return evaluations_; }

 private:
  CellPass cells_;
  SoftTerms soft_;
  int evaluations_ = 0;
};

}  // namespace lpdeform
