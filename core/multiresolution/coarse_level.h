#pragma once

#include <array>
#include <memory>
#include <vector>

#include "core/constraints/constraints.h"
#include "core/energy/material.h"
#include "core/energy/rest_shape.h"
#include "core/multiresolution/level_solver.h"

namespace lpdeform {

/// A shape with a sixth of the vertices, all of them vertices of the fine one, its own solver, and the way
/// between the two: the "subspace technique" of the paper's future work. What it finds is a guess for the fine
/// level, never an answer. One caller at a time.
class CoarseLevel {
 public:
  static constexpr std::int32_t kRatio = 6;

  /// Null where the mesh cannot be coarsened to half its vertices, or the coarse one has no solver.
  static std::unique_ptr<CoarseLevel> create(const RestShape& fine, const MakeLevelSolver& make_solver);

  /// Gives the solver what the fine level has: coarse_handles, and `material`. Where p_i is not 2, a coarse cell
  /// stands for m fine ones with E_i^2 a sum over them, so s_i is multiplied by m^(1 - p_i / 2).
  absl::Status take_over(const RestShape& fine, const HandleSet& handles, const Constraints& constraints,
                         const Material& material);

  LevelSolver& solver() { return *solver_; }

  /// The fine shape moved with the coarse one, in scaled units of the fine: each vertex follows the fitted rigid
  /// motions of the nearest of the coarse vertices around it, blended by distance.
  Points prolong(const RestShape& fine, const Workers& workers) const;

  std::size_t memory_bytes() const;

 private:
  CoarseLevel() = default;
  void find_guides(const RestShape& fine);

  static constexpr std::size_t kGuides = 4;
  struct Guides {
    std::array<std::int32_t, kGuides> vertex;  // coarse
    std::array<double, kGuides> weight;        // add up to 1
  };
  std::vector<std::int32_t> fine_vertex_, coarse_vertex_;  // see CoarseMesh
  std::vector<double> share_;                              // fine vertices for each coarse one
  std::vector<Guides> guides_;                             // of each fine vertex
  std::shared_ptr<const RestShape> shape_;
  std::unique_ptr<LevelSolver> solver_;
};

}  // namespace lpdeform
