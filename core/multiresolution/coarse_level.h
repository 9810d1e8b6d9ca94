#pragma once

#include <array>
#include <memory>
#include <vector>

#include "core/constraints/constraints.h"
#include "core/energy/material.h"
#include "core/energy/rest_shape.h"
#include "core/mesh/coarsen.h"
#include "core/multiresolution/level_solver.h"

namespace lpdeform {

/// A coarse level: a shape with a sixth of the fine shape's vertices, a solver of its own, and the restriction and
/// prolongation between the two levels. This is the "subspace technique" of the paper's future work. Its result is only
/// an initial guess for the fine level, never a final result. One caller at a time.
class CoarseLevel {
 public:
  static constexpr std::int32_t kRatio = 6;

  /// The mesh of the coarse level of `fine`.
  static CoarseMesh coarsened(const RestShape& fine);

  /// `coarse` is what coarsened() returns. Null if the mesh could not be coarsened to half its vertices, or if no solver
  /// can be made for the coarse shape.
  static std::unique_ptr<CoarseLevel> create(const RestShape& fine, CoarseMesh coarse,
                                             MakeLevelSolver make_solver);

  /// Restricts the inputs of the fine level to the coarse solver: coarse_handles, and `material`. A coarse cell stands
  /// for m fine cells, and its E_i^2 is a sum over them. If p_i is not 2, s_i is therefore multiplied by (m /
  /// kRatio)^(1 - p_i / 2) and clamped to the permitted range. `bending` is that of the fine cells
  /// (CellPass::set_bending); the coarse cells get the same.
  absl::Status take_over(const RestShape& fine, const HandleSet& handles, const Constraints& constraints,
                         const Material& material, double bending);

  /// Whether bend_like_fine() pays off: the fine level is large, or its own cells already bend like a finer level's, and its
  /// weights are not uniform.
  bool can_bend_like_fine() const;
  /// Lets the coarse solver's cells resist bending as the fine level does: multiplies their share by coarse vertices / fine
  /// vertices, until the next take_over(). Only if can_bend_like_fine().
  void bend_like_fine();
  /// Whether the coarse level is large enough to begin, with cells that bend like the fine level's, on a level below it.
  bool has_level_below() const { return shape_->vertex_count() >= kLeastEasedLevel; }

  static constexpr std::int32_t kLeastEasedLevel = 1000;  // vertices from which on has_level_below()

  /// Only between take_over() and leave().
  LevelSolver& solver() { return *solver_; }

  /// Call when the solver has ended and the fine level goes on. Large levels free their solver, which the fine level's
  /// workspace then takes the place of; the next take_over() makes it again.
  void leave();

  /// Prolongation: the fine shape moved with the coarse one, in scaled units of the fine shape. Each vertex follows the
  /// fitted rigid motions of the nearest coarse vertices around it, blended by distance.
  Points prolong(const RestShape& fine, const Workers& workers) const;

  /// Without temporary_bytes().
  std::size_t memory_bytes() const;
  /// Bytes of the solver, if leave() frees it.
  std::size_t temporary_bytes() const { return leaves() && solver_ ? solver_->memory_bytes() : 0; }

 private:
  CoarseLevel() = default;
  bool leaves() const { return shape_->vertex_count() > kMostKept; }
  void find_guides(const RestShape& fine);

  static constexpr std::int32_t kMostKept = 10000;   // vertices of a level that keeps its solver
  static constexpr std::size_t kLeastEased = 30000;  // fine vertices from which on bend_like_fine() pays off

  static constexpr std::size_t kGuides = 4;
  struct Guides {
    std::array<std::int32_t, kGuides> vertex;  // coarse
    std::array<double, kGuides> weight;        // weights add up to 1
  };
  std::vector<std::int32_t> fine_vertex_, coarse_vertex_;  // see CoarseMesh
  std::vector<double> share_;                              // the number of fine vertices of each coarse one
  std::vector<Guides> guides_;                             // of each fine vertex
  std::shared_ptr<const RestShape> shape_;
  double bending_ = 1;  // of the fine level
  MakeLevelSolver make_solver_;
  std::unique_ptr<LevelSolver> solver_;  // null if leave() has freed it
};

}  // namespace lpdeform
