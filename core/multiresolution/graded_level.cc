#include "core/multiresolution/graded_level.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/methods/quasi_newton.h"

namespace lpdeform {
namespace {

constexpr double kShare = 0.8;    // of the sum of E_i^q that the cells have which stay; q is the largest p_i,
constexpr double kMostPower = 3;  // but at most this: at a large p other cells come to be the worst ones
constexpr double kMostChosen = 0.2;  // of the fine vertices, before the ring around them is added
constexpr std::int32_t kRatio = 20;  // of the others, to one that the level has

/// The coarse vertices with the largest amounts for each fine vertex, until they have kShare of the sum, and the ring around them.
/// `amount` and `share`, the number of fine vertices, are of each coarse vertex.
std::vector<char> largest(const RestShape& coarse, const std::vector<double>& amount,
                          const std::vector<double>& share) {
  std::vector<std::int32_t> order(amount.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
    const double of_a = amount[a] / share[a], of_b = amount[b] / share[b];
    return of_a != of_b ? of_a > of_b : a < b;
  });
  const double enough = kShare * std::accumulate(amount.begin(), amount.end(), 0.0);
  const double most = kMostChosen * std::accumulate(share.begin(), share.end(), 0.0);
  std::vector<char> result(amount.size(), 0);
  double sum = 0, count = 0;
  for (const std::int32_t c : order) {
    if (sum >= enough || count >= most) break;
    sum += amount[c];
    count += share[c];
    result[c] = 1;
    for (std::int32_t k = coarse.offsets()[c]; k < coarse.offsets()[c + 1]; ++k)
      result[coarse.neighbours()[k]] = 1;
  }
  return result;
}

/// The vertices of a level that has those that stay, and a twentieth of the others.
std::int32_t size_with(const std::vector<char>& stays) {
  const auto all = static_cast<std::int32_t>(stays.size());
  const auto kept = static_cast<std::int32_t>(std::count(stays.begin(), stays.end(), 1));
  return kept + (all - kept) / kRatio;
}

}  // namespace

GradedLevel::GradedLevel(std::unique_ptr<CoarseLevel> level, const RestShape& fine)
    : level_(std::move(level)), before_(level_->pose(fine)) {}

std::vector<char> GradedLevel::chosen(const CoarseLevel& coarse, const std::vector<double>& squared_energies,
                                      double largest_p) {
  const double power = 0.5 * std::min(largest_p, kMostPower);
  const double typical = *std::max_element(squared_energies.begin(), squared_energies.end());
  if (!(typical > 0) || !std::isfinite(typical)) return {};
  std::vector<double> amount(coarse.share_.size(), 0.0);
  for (std::size_t v = 0; v < squared_energies.size(); ++v)
    amount[coarse.coarse_vertex_[v]] += std::pow(squared_energies[v] / typical, power);
  const std::vector<char> is_chosen = largest(*coarse.shape_, amount, coarse.share_);

  std::vector<char> stays(squared_energies.size());
  for (std::size_t v = 0; v < stays.size(); ++v) stays[v] = is_chosen[coarse.coarse_vertex_[v]];
  if (size_with(stays) > kLargest * static_cast<double>(stays.size())) return {};
  return stays;
}

std::unique_ptr<GradedLevel> GradedLevel::create(const FineInputs& fine, const Points& x,
                                                 const std::vector<char>& stays,
                                                 const MakeLevelSolver& make_solver,
                                                 const std::stop_token& stop) {
  CoarseMesh mesh = coarsen({fine.shape.positions(), fine.shape.faces()}, size_with(stays), stays);
  if (stop.stop_requested()) return nullptr;
  std::unique_ptr<CoarseLevel> level = CoarseLevel::create(fine.shape, std::move(mesh), make_solver);
  if (stop.stop_requested()) return nullptr;
  if (!level) return nullptr;
  level->ratio_ = 1;
  if (!level->restrict_inputs(fine).ok()) return nullptr;
  Field bending(static_cast<Eigen::Index>(level->share_.size()));
  for (std::size_t c = 0; c < level->share_.size(); ++c)
    bending[static_cast<Eigen::Index>(c)] = fine.bending / level->share_[c];
  level->solver().set_bending(bending);
  if (!level->set_state(fine.shape, level->at_coarse_vertices(x)).ok()) return nullptr;
  return std::unique_ptr<GradedLevel>(new GradedLevel(std::move(level), fine.shape));
}

absl::Status GradedLevel::start(double tolerance, std::stop_token stop) {
  SolveSettings settings;
  settings.method = Method::kQuasiNewton;
  settings.tolerance = tolerance;
  settings.effort = 0;
  settings.keep_trace = false;
  return level_->solver().start_prepared(settings, std::move(stop));
}

std::size_t GradedLevel::memory_bytes() const {
  return level_->memory_bytes() + before_.memory_bytes() +
         QuasiNewton::kBytesPerVertex * level_->share_.size();
}

Points GradedLevel::moved(const RestShape& fine, const Points& x, const Workers& workers) const {
  const CoarseLevel::Pose now = level_->pose(fine);
  Points result = level_->carried(x, before_, now, workers, nullptr);
  for (std::size_t c = 0; c < level_->share_.size(); ++c) {
    if (level_->share_[c] == 1)
      result.row(level_->fine_vertex_[c]) = now.positions.row(static_cast<Eigen::Index>(c));
  }
  return result;
}

}  // namespace lpdeform
