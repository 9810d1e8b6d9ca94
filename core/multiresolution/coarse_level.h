#pragma once

#include <array>
#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "core/constraints/constraints.h"
#include "core/energy/material.h"
#include "core/energy/rest_shape.h"
#include "core/energy/turn_kernel.h"
#include "core/mesh/coarsen.h"
#include "core/multiresolution/level_solver.h"

namespace lpdeform {

/// What a coarse level takes over from the fine level. `bending` is that of the fine cells (CellPass::set_bending).
struct FineInputs {
  const RestShape& shape;
  const HandleSet& handles;
  const Constraints& constraints;
  const Material& material;
  double bending;
};

/// How the fine surface goes with a coarse level that has moved.
struct CoarseMotion {
  Points positions;         // scaled units of the fine shape
  std::vector<Turn> turns;  // of each vertex; blends of rotations
};

/// A coarse level: a shape with a sixth of the fine shape's vertices, or a tenth of a large one's, a solver of its own,
/// and the restriction and prolongation between the two levels. This is the "subspace technique" of the paper's future
/// work. Its result is only an initial guess for the fine level, never a final result.
/// One caller at a time.
class CoarseLevel {
 public:
  /// Vertices of the fine shape over those of its coarse level, below kLarge vertices and from there on.
  static constexpr std::int32_t kRatio = 6, kRatioOfLarge = 10, kLarge = 60000;
  /// What a level holds of each fine vertex, beside the level's own shape and solver.
  static constexpr std::size_t kBytesPerFineVertex = 36;

  /// The mesh of the coarse level of `fine`.
  static CoarseMesh coarsened(const RestShape& fine);

  /// `coarse` is what coarsened() returns. Null if the mesh could not be coarsened to half its vertices, or if no solver
  /// can be made for the coarse shape.
  static std::unique_ptr<CoarseLevel> create(const RestShape& fine, CoarseMesh coarse,
                                             const MakeLevelSolver& make_solver);

  /// Restricts the inputs of the fine level to the coarse solver: coarse_handles, and the material. A coarse cell stands
  /// for m fine cells, and its E_i^2 is a sum over them. If p_i is not 2, s_i is therefore multiplied by (m /
  /// ratio_)^(1 - p_i / 2) and clamped to the permitted range. The coarse cells get the bending of the fine cells.
  absl::Status take_over(const FineInputs& fine);

  /// Whether a coarse level of this shape should lead in a drag: see lead().
  static bool can_lead(const RestShape& fine, double bending);
  /// In a drag the coarse level leads: takes the inputs over, with cells that bend like the fine ones, and lets its solver go on from
  /// its state for a few iterations, the more the smaller the level is. Returns how the fine surface goes with it from `from`
  /// (scaled units), which belongs to the state of before; from the rest shape if `from` is null. nullopt if the coarse solver does
  /// not take the inputs. Only if can_lead().
  std::optional<CoarseMotion> lead(const FineInputs& fine, const Points* from, const Workers& workers,
                                   std::stop_token stop);
  /// Takes the inputs over like lead(), and lets only the lowest level go to them, from `initial`. Returns its E, in the
  /// caller's units: at p = 2, about what the fine level's minimum has. The levels above stay where they are. nullopt if a level does
  /// not take the inputs, or if the lowest one makes no iteration.
  std::optional<double> least_energy(const FineInputs& fine, InitialGuess initial, std::stop_token stop);
  /// E of the lowest level where the last lead() or least_energy() has come to, in the caller's units. NaN if the level has taken other
  /// inputs or another state since then.
  double lowest_energy() const;
  /// The fine level, which is at `x` (scaled units), goes on alone. The next lead() first moves the coarse levels as it has moved
  /// by then.
  void go_alone(const Points& x);
  /// Takes the inputs over like lead(), and the fine state x (scaled units) as the state of the coarse solver.
  absl::Status go_to(const FineInputs& fine, const Points& x);

  /// Whether bend_like_fine() pays off: the fine level is large, or its own cells already bend like a finer level's, and its
  /// weights are not uniform.
  bool can_bend_like_fine() const;
  /// Lets the coarse solver's cells resist bending as the fine level does: multiplies their share by coarse vertices / fine
  /// vertices, until the next take_over(). Only if can_bend_like_fine().
  void bend_like_fine();
  /// Whether the fine level is a level itself, whose cells bend like those of a finer one.
  bool is_fine_eased() const { return bending_ < 1; }
  /// Whether the coarse level is large enough to begin, with cells that bend like the fine level's, on a level below it.
  bool has_level_below() const { return shape_->vertex_count() >= kLeastEasedLevel; }

  static constexpr std::int32_t kLeastEasedLevel = 1000;  // vertices from which on has_level_below()

  LevelSolver& solver() { return *solver_; }

  /// Prolongation: the fine shape moved with the coarse one, in scaled units of the fine shape. Each vertex follows the
  /// fitted rigid motions of the nearest coarse vertices around it, blended by distance.
  Points prolong(const RestShape& fine, const Workers& workers) const;

  std::size_t memory_bytes() const;

 private:
  friend class GradedLevel;  // is such a level, but for where its vertices are

  /// A coarse state: positions in scaled units of the fine shape, and the fitted rotations of the cells.
  struct Pose {
    Points positions;
    std::vector<Eigen::Matrix3d> rotations;

    std::size_t memory_bytes() const {
      return positions.size() * sizeof(double) + rotations.capacity() * sizeof(Eigen::Matrix3d);
    }
  };

  CoarseLevel() = default;
  static std::int32_t ratio_of(std::int32_t fine_vertices) {
    return fine_vertices < kLarge ? kRatio : kRatioOfLarge;
  }
  void find_guides(const RestShape& fine);
  absl::Status restrict_inputs(const FineInputs& fine);
  Points at_coarse_vertices(const Points& x) const;
  absl::Status set_state(const RestShape& fine, const Points& positions);
  bool catch_up(const FineInputs& fine, const Points& x);
  int most_iterations(const Material& material) const;
  bool go_to_handles(InitialGuess initial, int most_iterations, std::stop_token stop);
  Pose rest_pose(const RestShape& fine) const;
  Pose pose(const RestShape& fine) const;
  Points carried(const Points& from, const Pose& before, const Pose& now, const Workers& workers,
                 std::vector<Turn>* turns) const;

  static constexpr std::int32_t kLeastEased = 30000;  // fine vertices from which on bend_like_fine() pays off

  static constexpr std::size_t kGuides = 4;
  struct Guides {
    std::array<std::int32_t, kGuides> vertex;  // coarse
    std::array<float, kGuides> weight;         // they add up to 1, to single precision
  };
  static_assert(kBytesPerFineVertex == sizeof(std::int32_t) + sizeof(Guides));
  std::vector<std::int32_t> fine_vertex_, coarse_vertex_;  // see CoarseMesh
  std::vector<double> share_;                              // the number of fine vertices of each coarse one
  std::vector<Guides> guides_;                             // of each fine vertex
  std::shared_ptr<const RestShape> shape_;
  double ratio_ = kRatio;  // fine vertices of a cell whose stiffness is that of a fine cell
  double bending_ = 1;     // of the fine level
  std::unique_ptr<LevelSolver> solver_;
  /// The solver's state, where lead() has come to it. least_energy() may since have moved the solver of the lowest level on.
  std::optional<Pose> led_to_;
  bool is_lowest_at_inputs_ = false;  // see lowest_energy()
  std::optional<Points>
      alone_from_;  // the fine state at the coarse vertices, from which the fine level goes alone
};

}  // namespace lpdeform
