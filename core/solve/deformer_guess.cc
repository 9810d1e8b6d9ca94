#include "core/solve/deformer_impl.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace lpdeform {
namespace {

constexpr double kFarthestGuess = 2;  // the guess continues the last move by less than this factor
constexpr double kSameWay = 0.5;      // two moves count as one drag above this squared cosine between them
// In such a drag, the squared ratio of the surface's largest move to the handles' largest move is below this.
constexpr double kSteady = 9;
constexpr double kMostAbove = 2, kMostAboveAtP = 1.3;  // see is_good
constexpr double kClose = 1.25;                        // see is_close
constexpr double kLittleAbove = 1.2;                   // see is_as_good_as_before
constexpr double kHardlyAbove = 1.1;                   // see may_be_shown
// A move of so many iterations had time. Where guesses can only be compared, the guess alone may then have kMostOverUsual times as much
// of the lowest level's E^(1/p) as the state after that move; see most_over_least.
constexpr int kTimeToGoAlone = 6;
constexpr double kMostOverUsual = 1.05;
// A lowest level whose E^(1/p) is this many times less tells nothing: its own is of rounding.
constexpr double kMostUsual = 1000;
// After so many refused guesses in a row, the coarse levels take the fine state over at the next refusal.
constexpr int kMostRefused = 10;
// Moves that coarse levels lead after guess_alone has refused at p = 2, and where there was no time for an iteration after a guess that was not close.
constexpr int kMovesToLead = 3, kMovesToLeadWithoutTime = 12;
// Where coarse levels can lead, edges turn on after a move of at least this many iterations; see continued.
constexpr int kTimeToTurn = 4;

/// The squared length of the longest way that a vertex has moved.
double longest_move(const Points& before, const Points& now, const Workers& workers) {
  std::vector<double> longest((static_cast<std::size_t>(now.rows()) + kRowChunk - 1) / kRowChunk, 0.0);
  for_rows(now, workers, [&](Eigen::Index i) {
    double& chunk = longest[static_cast<std::size_t>(i) / kRowChunk];
    chunk = std::max(chunk, (now.row(i) - before.row(i)).squaredNorm());
  });
  return *std::max_element(longest.begin(), longest.end());
}

}  // namespace

/// The soft terms as springs (p = 2, for cells of weight 1), evaluated at the rest shape with held vertices at their
/// targets.
SoftTerms Deformer::Impl::guess_springs() const {
  SoftTerms springs = constraints->soft;
  springs.evaluate(constraints->targets, LpNorm(Material::uniform(2), shape->vertex_count(), unit(), 1));
  return springs;
}

/// x = rest + u, where u is the harmonic extension of the handles' displacements: the solution of the naive Laplacian
/// system L x = L p with given handle positions and with soft terms as springs.
Points Deformer::Impl::laplacian_guess() {
  Points u = constraints->targets - shape->scaled_positions();
  Points forces = Points::Zero(u.rows(), 3);
  guess_springs().add_gradient(forces);
  metric.extend(constraints->is_held, u, workers(), -forces / metric.scale());
  return shape->scaled_positions() + u;
}

/// The surface `moved`, fitted between the targets of held vertices in the metric, with `forces` as Metric::extend() takes them.
Points Deformer::Impl::fitted(const Points& moved, Points forces) const {
  Points u(moved.rows(), 3);
  for (const std::int32_t i : constraints->exact.vertices)
    u.row(i) = constraints->targets.row(i) - moved.row(i);
  metric.extend(constraints->is_held, u, workers(), std::move(forces));
  for_rows(u, workers(), [&](Eigen::Index i) {
    if (constraints->is_held[i])
      u.row(i) = constraints->targets.row(i);
    else
      u.row(i) += moved.row(i);
  });
  return u;
}

/// The forces that turn the edges of a motion, as Metric::extend() takes them.
template <typename Motion>
Points Deformer::Impl::turning_forces(const Motion& motion) {
  Points forces;
  objective.turning_forces(motion, metric.relative_cell_weights(), forces);
  return forces;
}

/// A drag that the coarse level leads: it goes to the handles first, and the surface goes with it. Each edge turns as the surface
/// around it does, and one solve in the metric fits the edges together between the handles.
std::optional<Points> Deformer::Impl::led_guess() {
  if (lead == Lead::kNone) return std::nullopt;
  const bool is_ahead = std::exchange(lead, Lead::kNone) == Lead::kAhead;
  const Points& from = is_ahead ? shape->scaled_positions() : x;
  const auto motion =
      coarse->lead(coarse_inputs(effective_material()), is_ahead ? nullptr : &x, workers(), stop);
  if (!motion) return std::nullopt;
  const Points& moved = motion->positions;
  lead = Lead::kTogether;
  return fitted(moved, turning_forces(TurnedMotion{from.data(), moved.data(), motion->turns.data()}));
}

/// Whether guesses are compared in the norm that is solved for, and not in that of p = 2. They are where no p_i is above 2, some p_i is
/// below 2, and there are no soft targets. The norm of p = 2 hides what is spread over many cells, which counts at a lower p. At a larger
/// p a few kinks would decide, which the first iterations take away. Soft targets in `objective` are still those of the last solve.
bool Deformer::Impl::compares_at_p() const {
  return material.p.maxCoeff() <= 2 && material.p.minCoeff() < 2 && constraints->soft.empty();
}

/// Whether a led guess is not much worse than the other one, by their sums in that norm: its E^(1/p), p the lowest p_i, is at most
/// kMostAbove times as high, or kMostAboveAtP times at p < 2. It may be higher, because it has kinks that the first iterations take away.
bool Deformer::Impl::is_good(double led, double other) const {
  const double most =
      compares_at_p() ? std::pow(kMostAboveAtP, material.p.minCoeff()) : kMostAbove * kMostAbove;
  return led <= most * other;
}

/// The same without another guess: its E^(1/2) at p = 2 is at most kLittleAbove times as high as that of the state before the move.
/// `objective` then holds its evaluation.
bool Deformer::Impl::is_as_good_as_before(const Points& led) {
  if (!constraints->soft.empty()) return false;  // the state before has no such terms for the new targets
  const double most = kLittleAbove * kLittleAbove * best_energies.squaredNorm();
  return is_guess_evaluated = objective.evaluate(led, even_norm()) * unit() * unit() <= most;
}

/// The same without making the other guess, at p = 2. It compares the led guess with the lowest level. `is_refused` says that
/// guess_alone has found the other one to have over kMostOverLeast times that energy. `objective` holds the evaluation of the led guess,
/// from is_as_good_as_before.
bool Deformer::Impl::is_led_near_lowest(const Points& led, bool is_refused) {
  if (!can_judge_guesses() || !led.allFinite()) return false;
  const auto least = coarse->least_energy(coarse_inputs(effective_material()), InitialGuess::kCurrent, stop);
  const double most = is_refused ? kMostAbove * kMostOverLeast : kMostOverLeast;
  return is_guess_evaluated = least && over_least(*least) <= most;
}

/// Whether a guess of the fine level alone, whose E_i^2 add up to `sum`, may be shown before the first iteration: its E^(1/2) is at most
/// kHardlyAbove times as high as that of the state before the move.
bool Deformer::Impl::may_be_shown(double sum) const {
  const double most = kHardlyAbove * kHardlyAbove * best_energies.squaredNorm();
  return are_cells_alike() && sum * unit() * unit() <= most;
}

/// Whether all cells have the same stiffness. Only then does a sum without it tell about a guess.
bool Deformer::Impl::are_cells_alike() const {
  return material.stiffness.size() == 1 && constraints->footprint.size() == 0;
}

/// Remembers the state before a move.
void Deformer::Impl::begin_move() {
  x_before_move.resize(x.rows(), 3);
  for_rows(x, workers(), [&](Eigen::Index i) { x_before_move.row(i) = x.row(i); });
}

/// Begins with a led guess. If some p_i > 2, the weights of the move before differ so much that a step in their metric is cut short.
Points Deformer::Impl::go_with(Points led) {
  refused = 0;
  if (material.p.maxCoeff() > 2) warmth = Warmth::kWarm;
  return led;
}

/// Lets the coarse level, where there is one, follow to `guess`, so that it can lead from the next move on.
void Deformer::Impl::follow(const Points& guess) {
  lead = Lead::kNone;
  if (make_coarse() && coarse->go_to(coarse_inputs(effective_material()), guess).ok()) lead = Lead::kTogether;
}

/// Whether each held vertex of `from` is where it is held.
bool Deformer::Impl::is_at_targets(const Points& from) const {
  const std::vector<std::int32_t>& held = constraints->exact.vertices;
  return std::all_of(held.begin(), held.end(),
                     [&](std::int32_t i) { return from.row(i) == constraints->targets.row(i); });
}

/// Goes on with a drag from x. If the handles move in about the same way as in the last move, by the factor `share` of that move, the
/// surface does the same. Each edge turns on as it has turned, and one solve in the metric fits the edges together between the handles.
/// On straight lines the surface would be stretched by the square of the angle. Where coarse levels can lead, edges turn on only after a
/// guess alone that was close, or after a move with time for iterations. Turning takes longer, and leaves a surface that is behind as far
/// behind. Straight lines also take on what the last iterations have corrected. If the handles move in another way, their displacement is
/// extended harmonically, with `forces`, those of soft targets, or empty.
Points Deformer::Impl::continued(Points forces) {
  if (x_before_move.rows() != x.rows()) return fitted(x, std::move(forces));
  const auto last = [this](Eigen::Index i) -> Eigen::RowVector3d { return x.row(i) - x_before_move.row(i); };
  double along = 0, size = 0, left = 0, longest = 0;
  for (const std::int32_t i : constraints->exact.vertices) {
    const Eigen::RowVector3d to_go = constraints->targets.row(i) - x.row(i);
    left += to_go.squaredNorm();
    along += to_go.dot(last(i));
    size += last(i).squaredNorm();
    longest = std::max(longest, last(i).squaredNorm());
  }
  const double share = size > 0 ? along / size : 0;
  const bool goes_on = share > 0 && share < kFarthestGuess && along * along > kSameWay * size * left &&
                       longest_move(x_before_move, x, workers()) < kSteady * longest;
  if (!goes_on) return fitted(x, std::move(forces));
  Points moved(x.rows(), 3);
  for_rows(moved, workers(), [&](Eigen::Index i) { moved.row(i) = x.row(i) + share * last(i); });
  const bool turns_on =
      !CoarseLevel::can_lead(*shape, least_bending()) || is_close || fine_iterations >= kTimeToTurn;
  if (!turns_on) return fitted(moved, {});
  // Soft targets move with the drag.
  return fitted(moved, turning_forces(OngoingMotion{x_before_move.data(), x.data(), share}));
}

/// How many times the E^(1/p) of the lowest level the guess alone may have; 0 if the lowest level tells nothing. At p = 2 it tells about
/// what the minimum has. At another p it may be far from it. But it changes with the handles in the same way, so that a guess can be
/// compared with the state after the last move that had time. Sets usual_over_least, and has to be called before the lowest level goes
/// to the new handles.
double Deformer::Impl::most_over_least() {
  if (can_judge_guesses()) return kMostOverLeast;
  if (!can_compare_guesses()) return 0;
  if (fine_iterations >= kTimeToGoAlone) {
    const double over = std::pow(energy_before / coarse->lowest_energy(), 1 / material.p(0));
    usual_over_least = over <= kMostUsual ? std::optional(over) : std::nullopt;
  }
  return kMostOverUsual * usual_over_least.value_or(0);
}

/// The guess of a drag that the coarse levels do not lead. It takes half of the time. nullopt if it is not good enough: if its E^(1/p)
/// is more than `most_over` times that of the lowest level.
std::optional<Points> Deformer::Impl::guess_alone(double most_over) {
  std::optional<double> least;
  Points guess;
  workers().run_both(
      [&] {
        least = coarse->least_energy(coarse_inputs(effective_material()), InitialGuess::kCurrent, stop);
      },
      [&] { guess = continued({}); });
  if (!least || !guess.allFinite()) return std::nullopt;
  const double sum = objective.evaluate(guess, even_norm());
  const double over = over_least(*least);
  if (!(over <= most_over)) return std::nullopt;
  is_close = usual_over_least || over <= kClose;
  is_guess_evaluated = true;
  is_guess_smooth = !usual_over_least && may_be_shown(sum);
  return guess;
}

/// The guess of a solve that goes on from x: by the fine level alone, where that is good enough, or led by the coarse levels.
Points Deformer::Impl::current_guess() {
  Points forces;
  const SoftTerms& before = objective.soft_terms();
  if (!constraints->soft.empty() && constraints->soft.has_rows_of(before)) {
    forces = Points::Zero(x.rows(), 3);
    constraints->soft.add_pull(before, forces);
    forces /= metric.scale();
  }
  if (is_at_targets(x) && forces.isZero(0)) {
    lead = Lead::kNone;  // the fine level goes on alone
    begin_move();
    return x;
  }
  const bool can_lead = warmth != Warmth::kCold && CoarseLevel::can_lead(*shape, least_bending());
  const bool had_no_time = std::exchange(goes_alone, false) && !is_close && fine_iterations == 0;
  if (had_no_time) moves_to_lead = kMovesToLeadWithoutTime;
  const bool is_to_lead = moves_to_lead > 0;
  if (is_to_lead) --moves_to_lead;
  if (lead != Lead::kTogether || can_judge_guesses()) usual_over_least.reset();
  const double most_over = can_lead && lead == Lead::kTogether && !is_to_lead ? most_over_least() : 0;
  const bool is_to_judge = most_over > 0;
  if (is_to_judge) {
    if (std::optional<Points> alone = guess_alone(most_over)) {
      coarse->go_alone(x);
      begin_move();
      goes_alone = true;
      return *std::move(alone);
    }
    if (can_judge_guesses()) moves_to_lead = kMovesToLead;
    usual_over_least.reset();
  }
  is_close = false;
  const bool was_ahead = lead == Lead::kAhead;
  std::optional<Points> led = can_lead ? led_guess() : std::nullopt;
  if (led && is_as_good_as_before(*led)) {
    begin_move();
    // At a larger p, kinks of a guess show.
    is_guess_smooth = material.p.maxCoeff() <= 2 && are_cells_alike() && constraints->linear.empty();
    return go_with(*std::move(led));
  }
  if (led && is_led_near_lowest(*led, is_to_judge)) {
    begin_move();
    return go_with(*std::move(led));
  }
  const bool has_soft = !constraints->soft.empty();
  std::optional<LpNorm> norm;
  double of_led = 0;
  if (led && led->allFinite()) {
    norm = compares_at_p() ? LpNorm(effective_material(), shape->vertex_count(), unit(), 1) : even_norm();
    of_led = has_soft ? objective.evaluate(*led, *norm) : objective.sum(*norm);
  }
  Points guess = continued(std::move(forces));
  begin_move();
  if (!can_lead) return guess;
  if (!guess.allFinite()) {
    lead = Lead::kNone;
    return guess;
  }
  if (norm && is_good(of_led, objective.evaluate(guess, *norm))) return go_with(*std::move(led));
  // The coarse levels stay where they have gone. If they followed to the guess, they would first go back to a minimum of their own in the
  // next move, and the surface with them.
  if (!norm || was_ahead || ++refused > kMostRefused) {
    refused = 0;
    follow(guess);
  } else {
    is_guess_evaluated = !has_soft;
  }
  return guess;
}

Points Deformer::Impl::initial_guess(InitialGuess guess) {
  is_guess_evaluated = false;
  Points result;
  if (warmth == Warmth::kPrepared)
    result = x;
  else if (guess == InitialGuess::kRest)
    result = constraints->targets;
  else if (guess == InitialGuess::kCurrent && state != State::kUntouched)
    result = current_guess();
  else
    result = laplacian_guess();
  if (is_guess_evaluated && constraints->linear.empty()) return result;
  is_guess_evaluated = false;
  // Sets held vertices exactly to their targets, which removes the solve's rounding.
  for (const std::int32_t i : constraints->exact.vertices) result.row(i) = constraints->targets.row(i);
  constraints->linear.satisfy_within(metric, result, workers());
  return result;
}

}  // namespace lpdeform
