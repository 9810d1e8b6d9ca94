#pragma once

#include <cstddef>
#include <memory>
#include <stop_token>
#include <vector>

#include "core/multiresolution/coarse_level.h"

namespace lpdeform {

/// A level between a coarse level and the fine one: all vertices of the fine mesh where the distortion is, and a twentieth of them
/// elsewhere. Most of what the fine level has left to do after a coarse level happens where the distortion is, which is a small part of
/// the surface (tests/bench/tried.md). The rest has to move along, mostly rigidly. Each cell resists bending as the
/// fine cells that it stands for (CellPass::set_bending). One caller at a time.
class GradedLevel {
 public:
  static constexpr double kLargest = 0.45;  // the level's vertices, as a share of the fine ones
  /// What it holds of each of its vertices, beside its shape and solver: the pose before, constraints and shares.
  static constexpr std::size_t kBytesPerVertex = 140;

  /// Which fine vertices such a level has at least, for a state with the E_i^2 `squared_energies`. `largest_p` is the largest p_i. Empty if
  /// the distortion is spread so widely that the level would be too large, or if there is none.
  static std::vector<char> chosen(const CoarseLevel& coarse, const std::vector<double>& squared_energies,
                                  double largest_p);
  /// With the vertices that chosen() has found, at the fine state x (scaled units). Null if no solver takes it, or once `stop` is
  /// requested: at a million vertices it takes two seconds.
  static std::unique_ptr<GradedLevel> create(const FineInputs& fine, const Points& x,
                                             const std::vector<char>& stays,
                                             const MakeLevelSolver& make_solver, const std::stop_token& stop);

  /// Begins to solve from x, as after a coarse level. Then call solver().step() until it returns false.
  absl::Status start(double tolerance, std::stop_token stop);
  LevelSolver& solver() { return level_->solver(); }

  /// The fine state x, moved along with this level since start(). Fine vertices that stand only for themselves on this level are where it has them.
  /// Held vertices are only about where they are held.
  Points moved(const RestShape& fine, const Points& x, const Workers& workers) const;

  /// With what its solver takes while it runs.
  std::size_t memory_bytes() const;

 private:
  GradedLevel(std::unique_ptr<CoarseLevel> level, const RestShape& fine);

  std::unique_ptr<CoarseLevel> level_;
  CoarseLevel::Pose before_;
};

}  // namespace lpdeform
