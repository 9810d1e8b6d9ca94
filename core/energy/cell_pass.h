#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/base/workers.h"
#include "core/energy/cell_blocks.h"
#include "core/energy/cell_kernel.h"
#include "core/energy/lp_norm.h"
#include "core/energy/membrane.h"
#include "core/energy/rest_shape.h"
#include "core/energy/turn_kernel.h"

namespace lpdeform {

/// Rotations, cell energies, objective and gradient of a deformed shape x (scaled units, all vertices):
///
///   E_i^2    = min over rotations R_i of sum_{j in N(i)} w_ij |(x_i - x_j) - R_i (p_i - p_j)|^2     (Eq. 2)
///   f(x)     = sum_i term_i(E_i^2)                                                                  (Eq. 3)
///   df/dx_k  = sum_{j in N(k)} 2 w_kj [(c_k + c_j)(x_k - x_j) - (c_k R_k + c_j R_j)(p_k - p_j)]
///   c_i      = weight_i(E_i^2)
///
/// w_ij are the weights (weights.h), and p_i is the rest position of vertex i, as in the paper. The exponents, also
/// called p_i, are inside term_i and weight_i (lp_norm.h). f is Eq. 3 but for a constant factor.
///
/// The gradient is that of f with fitted rotations: they are optimal for every p, so their own change adds nothing
/// (envelope theorem). Runs in parallel in chunks of a fixed size and sums in chunk order, which gives the same bits on
/// any number of threads. One caller at a time.
class CellPass {
 public:
  CellPass(std::shared_ptr<const RestShape> shape, Workers workers);

  /// Only for coarse levels: from the next evaluation on, cell i keeps the share b_i of its resistance to bending, 0 < b_i <= 1,
  /// and all of its resistance to stretching. With b_i < 1,
  ///
  ///   E_i^2 = b_i (Eq. 2) + (1 - b_i) / 3 sum_{faces T at i} E_T^2        (membrane.h)
  ///
  /// A cell's resistance to bending grows as the square of its edges, beside that to stretching. A coarse level with b_i =
  /// its vertices / those of the fine level there therefore bends like the fine level. One share for all cells, or one for each.
  /// Not for uniform weights, whose cells are in other units than faces.
  void set_bending(const Field& shares);
  void set_bending(double share) { set_bending(Field::Constant(1, share)); }
  /// Whether all b_i are 1.
  bool bends_as_cells() const { return !membrane_; }

  /// f at x, all rotations fitted.
  double evaluate(const Points& x, const LpNorm& norm);
  /// f at x with the rotations of the last evaluate.
  double evaluate_held(const Points& x, const LpNorm& norm);
  /// f of another norm at the x of the last evaluation; gradient() follows it.
  double reweigh(const LpNorm& norm);
  /// f of another norm at the x of the last evaluation; changes nothing.
  double sum(const LpNorm& norm) const;
  /// The gradient at the x, norm and rotations of the last evaluation.
  void gradient(Points& result) const;
  /// The forces on the surface where a motion ends that turn its edges: minus the gradient of
  ///
  ///   sum_i c_i sum_{j in N(i)} w_ij |y_ij - e_ij T_i|^2
  ///
  /// for the edges y_ij, which are where the motion ends; for them, e_ij and T_i see turn_blocks(). A solve in the metric of these c_i
  /// then fits the turned edges together (Metric::extend). gradient() needs another evaluation afterwards.
  void turning_forces(const OngoingMotion& motion, const std::vector<double>& c, Points& forces);
  void turning_forces(const TurnedMotion& motion, const std::vector<double>& c, Points& forces);

  // Of the last evaluation.
  const std::vector<double>& squared_energies() const { return state_.squared; }  // E_i^2
  const std::vector<double>& cell_weights() const { return c_; }                  // c_i
  std::vector<Eigen::Matrix3d> rotations() const;  // R_i; the first call takes as long as an evaluation

  const RestShape& shape() const { return *shape_; }
  const Workers& workers() const { return workers_; }
  std::size_t memory_bytes() const;

  static constexpr std::size_t kChunk = 512;  // cells

 private:
  template <typename Body>
  double sum_of_chunks(const Body& body) const;
  double weigh(const LpNorm& norm, std::size_t begin, std::size_t end);
  void replace_bending(std::size_t begin, std::size_t end) const;
  double evaluate_cells(const Points& x, const LpNorm& norm, bool fit);
  void keep_rotations() const;
  template <typename Motion>
  void find_turning_forces(const Motion& motion, const std::vector<double>& c, Points& forces);

  std::shared_ptr<const RestShape> shape_;
  Workers workers_;
  CellBlocks blocks_;
  mutable BlockState state_;  // its rotations are made when first needed after an evaluation
  double bending(std::size_t i) const { return bending_[bending_.size() == 1 ? 0 : i]; }

  Field bending_ = Field::Ones(1);
  std::optional<Membrane> membrane_;                  // if some b_i < 1
  mutable std::vector<double> bent_c_, stretched_c_;  // b_i c_i and (1 - b_i) c_i, if some b_i < 1
  std::vector<double> rows_;                          // x, with fillers
  std::vector<double> c_;
  mutable std::vector<double> chunk_sums_;
};

}  // namespace lpdeform
