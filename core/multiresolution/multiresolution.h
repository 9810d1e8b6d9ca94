#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <vector>

#include "core/methods/minimiser.h"
#include "core/methods/quasi_newton.h"
#include "core/multiresolution/coarse_level.h"
#include "core/multiresolution/graded_level.h"

namespace lpdeform {

/// What a graded level takes.
struct Grading {
  const HandleSet& handles;
  Material material;  // as FineInputs::material
  MakeLevelSolver make_solver;
  bool is_early = false;       // one is to come early, whatever is left to do
  bool may_come_late = false;  // one may come later
};

/// Solves the coarse level first, by any method that suits it (which may include a level below it), then runs
/// QuasiNewton from the prolonged result, whose kinks are eased first (kinks.h). On large meshes the coarse level is
/// solved as it is, which finds the better minima, and goes on with cells that bend like those of the fine level
/// (CoarseLevel::bend_like_fine), which saves fine iterations. If the handles have moved little, there is as a rule one
/// minimum to find. All levels then have such cells from the beginning; only the lowest is first solved with the bending
/// of the level above it. The long way along a curved valley is travelled where an iteration costs least.
///
/// On very large meshes a graded level (graded_level.h) follows after some fine iterations, or before them if some p_i > 2, unless the
/// handles have moved little. The fine level goes on from its result. If no p_i is above 2, one may come late, also on smaller
/// meshes: where the fine level still has a long way to go. On very large meshes it is the second.
///
/// One iteration of the coarse or the graded level counts as one iteration here. Until the coarse level has ended, the state is the
/// initial guess. While the graded level runs, it is the fine state before. If the prolonged result is not better than the initial
/// guess, QuasiNewton starts from the guess, and there is no graded level.
/// The convergence criterion is that of QuasiNewton.
class Multiresolution : public Minimiser {
 public:
  /// `level` must already have the handles and the material (take_over), and must outlive this object. If `effort` is not 0,
  /// the coarse level looks for lower minima with this effort (SolveSettings::effort); unless it finds one, the outcome is
  /// kBreakdown and the fine level is not begun. Without `grading` there is no graded level.
  Multiresolution(Problem problem, Points x, CoarseLevel& level, int effort,
                  std::optional<Grading> grading = std::nullopt);

  StepResult step() override;
  const Points& x() const override { return fine_ ? fine_->x() : x_; }
  std::size_t level_bytes() const override { return graded_ ? graded_->memory_bytes() : 0; }
  /// The prolonged state of the coarse or the graded level. This costs about as much as three iterations, or five on a graded level. So
  /// there is a new one only when four times that time has passed since the previous one, or if it is the last.
  std::optional<Points> intermediate_state(bool is_last) override;

 private:
  static constexpr int kFirstLook = 8;

  bool is_gentle() const;
  double first_tolerance() const;
  Points prolonged();
  void make_feasible(Points& found) const;
  void even_out(Points& found) const;
  LpNorm even_norm() const;
  bool begin_to_ease();
  bool begin_graded(const std::vector<char>& stays);
  std::vector<char> chosen_for_graded();
  void end_grading();
  Warmth warmth_of_fine() const;
  bool is_time_for_graded();
  void leave_fine();
  Points moved_with_graded() const;
  void end_graded();
  void end_coarse();

  Problem problem_;
  Points x_;
  double objective_ = 0;
  CoarseLevel& level_;
  const bool is_search_;
  bool is_eased_ = false;  // the coarse level has cells that bend like the fine ones
  bool goes_on_ = false;   // it was solved without them first
  int looked_at_ = 0;      // iterations of the coarse level at the last prolongation
  std::chrono::steady_clock::time_point next_look_;
  std::optional<Grading> grading_;       // as long as a graded level may come
  std::unique_ptr<GradedLevel> graded_;  // while it runs
  std::unique_ptr<QuasiNewton> fine_;    // null while another level runs
  int fine_iterations_ = 0;
  int since_level_ = 0;      // fine iterations since another level ended
  double sum_ = 0;           // of problem_.norm, after the last of them
  double reckoned_sum_ = 0;  // the same when it was last reckoned what is left
  int stage_ = 0;            // of the last step
  int stages_before_ = 1;    // those before fine_; stage 0 is the coarse level
};

}  // namespace lpdeform
