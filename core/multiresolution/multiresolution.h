#pragma once

#include <memory>
#include <optional>

#include "core/methods/minimiser.h"
#include "core/methods/quasi_newton.h"
#include "core/multiresolution/coarse_level.h"

namespace lpdeform {

/// The coarse level first, by any method that suits it (a level below it included), then QuasiNewton from what it
/// prolongs to. One iteration of the coarse level counts as one here; the state is the guess until it has ended.
/// Where it finds nothing better than the guess, this is QuasiNewton from there. Converged as that.
class Multiresolution : public Minimiser {
 public:
  /// `level` has taken the handles and the material over and outlives this.
  Multiresolution(Problem problem, Points x, CoarseLevel& level);

  StepResult step() override;
  const Points& x() const override { return fine_ ? fine_->x() : x_; }
  /// The coarse level's state prolonged: about two iterations' work, so only where that has taken twice the iterations
  /// of the time before.
  std::optional<Points> in_hand() override;

 private:
  static constexpr int kFirstLook = 8;

  Points prolonged();
  void even_out(Points& found) const;
  void begin_fine();

  Problem problem_;
  Points x_;
  double objective_ = 0;
  CoarseLevel& level_;
  int next_look_ = kFirstLook;         // of the coarse level's iterations
  std::unique_ptr<QuasiNewton> fine_;  // none while the coarse level runs
};

}  // namespace lpdeform
