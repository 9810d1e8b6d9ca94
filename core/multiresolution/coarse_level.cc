#include "core/multiresolution/coarse_level.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/multiresolution/coarse_handles.h"

namespace lpdeform {
namespace {

constexpr std::size_t kChunk = 4096;  // vertices

/// For a move, a level makes work / vertices iterations, but at least `least` and at most kMostLeading. If no p_i is above 2, the lowest
/// level makes kMostLeading.
struct Leading {
  std::int32_t work, least;
};
constexpr Leading kLeading = {22000, 3}, kLeadingAtLargeP = {70000, 4};
constexpr std::int32_t kMostLeading = 100;
constexpr double kLeadingTolerance = 1e-3;

/// The field at the coarse vertices; a single value stays a single value.
Field restricted(const Field& field, const std::vector<std::int32_t>& fine_vertex) {
  if (field.size() == 1) return field;
  Field result(static_cast<Eigen::Index>(fine_vertex.size()));
  for (std::size_t c = 0; c < fine_vertex.size(); ++c)
    result[static_cast<Eigen::Index>(c)] = field[fine_vertex[c]];
  return result;
}

/// A cell is thin if all its edges that weigh something lie in one line: if l_1 l_2 + l_1 l_3 + l_2 l_3 <= kThin (l_1 + l_2 + l_3)^2 ,
/// l_k the eigenvalues of sum_j w_ij (p_i - p_j)^T (p_i - p_j). How it has turned about that line is left to rounding. A corner that is in
/// one face only has two edges. Where that face has a right or an obtuse angle at another corner, one of them weighs nothing.
constexpr double kThin = 1e-6;

std::vector<char> thin_cells(const RestShape& shape) {
  const Points& rest = shape.scaled_positions();
  std::vector<char> result(static_cast<std::size_t>(shape.vertex_count()));
  for (std::int32_t i = 0; i < shape.vertex_count(); ++i) {
    Eigen::Matrix3d b = Eigen::Matrix3d::Zero();
    for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
      const Eigen::RowVector3d edge = rest.row(i) - rest.row(shape.neighbours()[k]);
      b.noalias() += shape.weights()[k] * edge.transpose() * edge;
    }
    const double squared = b.trace() * b.trace();
    const double pairs = (squared - b.squaredNorm()) / 2;  // l_1 l_2 + l_1 l_3 + l_2 l_3
    result[static_cast<std::size_t>(i)] = pairs > kThin * squared ? 0 : 1;
  }
  return result;
}

double at(const Field& field, Eigen::Index i) {
  return field.size() == 1 ? field[0] : field[i];
}

}  // namespace

CoarseMesh CoarseLevel::coarsened(const RestShape& fine) {
  return coarsen({fine.positions(), fine.faces()}, fine.vertex_count() / ratio_of(fine.vertex_count()));
}

std::unique_ptr<CoarseLevel> CoarseLevel::create(const RestShape& fine, CoarseMesh coarse,
                                                 const MakeLevelSolver& make_solver) {
  if (2 * coarse.mesh.vertices.rows() > fine.vertex_count() || coarse.mesh.faces.rows() == 0) return nullptr;
  auto shape = RestShape::create(coarse.mesh, fine.weight_kind());
  if (!shape.ok()) return nullptr;
  std::unique_ptr<LevelSolver> solver = make_solver(*shape);
  if (!solver) return nullptr;
  std::unique_ptr<CoarseLevel> level(new CoarseLevel);
  level->ratio_ = ratio_of(fine.vertex_count());
  level->fine_vertex_ = std::move(coarse.fine_vertex);
  level->coarse_vertex_ = std::move(coarse.coarse_vertex);
  level->share_.assign(level->fine_vertex_.size(), 0.0);
  for (const std::int32_t c : level->coarse_vertex_) level->share_[c] += 1;
  level->shape_ = *std::move(shape);
  level->solver_ = std::move(solver);
  level->find_guides(fine);
  return level;
}

/// Finds the guides of each fine vertex: of the coarse vertex that it was collapsed into and that vertex's neighbours,
/// the nearest kGuides. They are weighted so that the weight of the next nearest would be 0. Thin cells guide only where there
/// are no others.
void CoarseLevel::find_guides(const RestShape& fine) {
  const double unit = shape_->mean_edge_length() / fine.mean_edge_length();
  const double least = 1e-3 * unit;
  guides_.resize(coarse_vertex_.size());
  const std::vector<char> is_thin = thin_cells(*shape_);
  std::vector<std::pair<double, std::int32_t>> near;
  for (std::size_t v = 0; v < coarse_vertex_.size(); ++v) {
    const std::int32_t own = coarse_vertex_[v];
    const auto distance = [&](std::int32_t c) {
      return (fine.scaled_positions().row(static_cast<Eigen::Index>(v)) -
              fine.scaled_positions().row(fine_vertex_[c]))
          .norm();
    };
    near.assign(1, {distance(own), own});
    for (std::int32_t k = shape_->offsets()[own]; k < shape_->offsets()[own + 1]; ++k) {
      near.emplace_back(distance(shape_->neighbours()[k]), shape_->neighbours()[k]);
    }
    const auto tells_little = [&](const auto& guide) { return is_thin[guide.second] != 0; };
    if (!std::all_of(near.begin(), near.end(), tells_little)) std::erase_if(near, tells_little);
    std::sort(near.begin(), near.end());
    const double farthest = near.size() > kGuides ? near[kGuides].first : near.back().first * 1.5 + unit;
    Guides guides{};
    guides.vertex.fill(own);
    std::array<double, kGuides> weights{};
    double sum = 0;
    for (std::size_t k = 0; k < std::min(kGuides, near.size()); ++k) {
      guides.vertex[k] = near[k].second;
      const double weight = 1 / (near[k].first + least) - 1 / (farthest + least);
      sum += weights[k] = weight * weight;
    }
    if (!(sum > 0)) sum = weights[0] = 1;
    for (std::size_t k = 0; k < kGuides; ++k) guides.weight[k] = static_cast<float>(weights[k] / sum);
    guides_[v] = guides;
  }
}

absl::Status CoarseLevel::restrict_inputs(const FineInputs& fine) {
  const std::size_t n = fine_vertex_.size();
  const Material& material = fine.material;
  Material coarse{restricted(material.p, fine_vertex_), restricted(material.stiffness, fine_vertex_),
                  material.length_unit > 0 ? material.length_unit : fine.shape.mean_edge_length()};
  if (material.p.size() > 1 || material.p[0] != 2) {
    Field stiffness(static_cast<Eigen::Index>(n));
    for (std::size_t c = 0; c < n; ++c) {
      const auto i = static_cast<Eigen::Index>(c);
      stiffness[i] =
          std::clamp(at(coarse.stiffness, i) * std::pow(share_[c] / ratio_, 1 - at(coarse.p, i) / 2),
                     Material::kLowestStiffness, Material::kHighestStiffness);
    }
    coarse.stiffness = std::move(stiffness);
  }
  bending_ = fine.bending;
  is_lowest_at_inputs_ = false;
  absl::Status status = solver_->set_material(coarse);
  status.Update(solver_->set_handles(
      coarse_handles({fine.shape, *shape_, fine_vertex_, coarse_vertex_}, fine.handles, fine.constraints)));
  return status;
}

absl::Status CoarseLevel::take_over(const FineInputs& fine) {
  led_to_.reset();
  alone_from_.reset();
  solver_->set_bending(Field::Constant(1, fine.bending));
  return restrict_inputs(fine);
}

bool CoarseLevel::can_lead(const RestShape& fine, double bending) {
  return fine.vertex_count() >= (bending < 1 ? kLeastEasedLevel : kLeastEased) &&
         fine.weight_kind() != WeightKind::kUniform;
}

std::optional<CoarseMotion> CoarseLevel::lead(const FineInputs& fine, const Points* from,
                                              const Workers& workers, std::stop_token stop) {
  if (from && alone_from_ && !catch_up(fine, *from)) return std::nullopt;
  alone_from_.reset();
  std::optional<Pose> before = std::exchange(led_to_, {});
  if (!from)
    before = rest_pose(fine.shape);
  else if (!before)
    before = pose(fine.shape);
  if (!restrict_inputs(fine).ok()) return std::nullopt;
  bend_like_fine();
  if (!go_to_handles(InitialGuess::kCurrent, most_iterations(fine.material), std::move(stop)))
    return std::nullopt;
  led_to_ = pose(fine.shape);
  is_lowest_at_inputs_ = true;
  CoarseMotion motion;
  motion.positions =
      carried(from ? *from : fine.shape.scaled_positions(), *before, *led_to_, workers, &motion.turns);
  return motion;
}

std::optional<double> CoarseLevel::least_energy(const FineInputs& fine, InitialGuess initial,
                                                std::stop_token stop) {
  if (!led_to_ && !has_level_below()) led_to_ = pose(fine.shape);
  if (!restrict_inputs(fine).ok()) return std::nullopt;
  bend_like_fine();
  if (has_level_below()) {
    const std::optional<double> least = solver_->least_energy(initial, std::move(stop));
    is_lowest_at_inputs_ = least.has_value();
    return least;
  }
  if (!go_to_handles(initial, kMostLeading, std::move(stop)) || solver_->iterations() == 0)
    return std::nullopt;
  is_lowest_at_inputs_ = true;
  return solver_->energy();
}

double CoarseLevel::lowest_energy() const {
  if (!is_lowest_at_inputs_) return std::numeric_limits<double>::quiet_NaN();
  return has_level_below() ? solver_->lowest_energy() : solver_->energy();
}

int CoarseLevel::most_iterations(const Material& material) const {
  const bool is_large_p = material.p.maxCoeff() > 2;
  if (!is_large_p && !has_level_below()) return kMostLeading;
  const Leading leading = is_large_p ? kLeadingAtLargeP : kLeading;
  return std::clamp(leading.work / shape_->vertex_count(), leading.least, kMostLeading);
}

bool CoarseLevel::go_to_handles(InitialGuess initial, int most_iterations, std::stop_token stop) {
  SolveSettings settings;
  settings.initial = initial;
  settings.method = Method::kQuasiNewton;
  settings.tolerance = kLeadingTolerance;
  settings.effort = 0;
  settings.keep_trace = false;
  settings.max_iterations = most_iterations;
  if (!solver_->start(settings, std::move(stop)).ok()) return false;
  while (solver_->step()) {
  }
  return true;
}

void CoarseLevel::go_alone(const Points& x) {
  if (!alone_from_) alone_from_ = at_coarse_vertices(x);
}

/// Moves the coarse levels as the fine level, which is at `x` now, has moved since go_alone().
bool CoarseLevel::catch_up(const FineInputs& fine, const Points& x) {
  const Points by = at_coarse_vertices(x) - *alone_from_;
  if (has_level_below()) {
    solver_->displace(fine.shape.mean_edge_length() * by);
  } else {
    const Points from = led_to_ ? led_to_->positions : pose(fine.shape).positions;
    if (!set_state(fine.shape, from + by).ok()) return false;
  }
  led_to_.reset();
  return true;
}

absl::Status CoarseLevel::go_to(const FineInputs& fine, const Points& x) {
  led_to_.reset();
  alone_from_.reset();
  absl::Status status = restrict_inputs(fine);
  bend_like_fine();
  status.Update(set_state(fine.shape, at_coarse_vertices(x)));
  return status;
}

/// Sets the solver's positions, given in scaled units of the fine shape.
absl::Status CoarseLevel::set_state(const RestShape& fine, const Points& positions) {
  return solver_->set_positions((positions * fine.mean_edge_length()).rowwise() + fine.centre());
}

Points CoarseLevel::at_coarse_vertices(const Points& x) const {
  Points result(static_cast<Eigen::Index>(fine_vertex_.size()), 3);
  for (std::size_t c = 0; c < fine_vertex_.size(); ++c)
    result.row(static_cast<Eigen::Index>(c)) = x.row(fine_vertex_[c]);
  return result;
}

CoarseLevel::Pose CoarseLevel::rest_pose(const RestShape& fine) const {
  return {at_coarse_vertices(fine.scaled_positions()),
          std::vector<Eigen::Matrix3d>(fine_vertex_.size(), Eigen::Matrix3d::Identity())};
}

CoarseLevel::Pose CoarseLevel::pose(const RestShape& fine) const {
  return {(solver_->positions().rowwise() - fine.centre()) / fine.mean_edge_length(), solver_->rotations()};
}

/// The fine surface `from`, moved as its guides have moved from one coarse state to another. With `turns`, writes them too.
Points CoarseLevel::carried(const Points& from, const Pose& before, const Pose& now, const Workers& workers,
                            std::vector<Turn>* turns) const {
  // A row vector d becomes d M.topRows<3>() + M.row(3).
  using AffineMotion = Eigen::Matrix<double, 4, 3, Eigen::RowMajor>;
  std::vector<AffineMotion> coarse_motions(fine_vertex_.size());
  workers.for_chunks(coarse_motions.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t c = begin; c < end; ++c) {
      const auto row = static_cast<Eigen::Index>(c);
      AffineMotion& motion = coarse_motions[c];
      motion.topRows<3>() = before.rotations[c] * now.rotations[c].transpose();
      motion.row(3) = now.positions.row(row) - before.positions.row(row) * motion.topRows<3>();
    }
  });
  Points result(from.rows(), 3);
  if (turns) turns->resize(static_cast<std::size_t>(from.rows()));
  const auto place = [&](std::size_t v) {
    const auto row = static_cast<Eigen::Index>(v);
    const Guides& guides = guides_[v];
    double sum = 0;
    AffineMotion motion = AffineMotion::Zero();
    for (std::size_t k = 0; k < kGuides; ++k) {
      motion += guides.weight[k] * coarse_motions[guides.vertex[k]];
      sum += guides.weight[k];
    }
    motion /= sum;
    result.row(row) = from.row(row) * motion.topRows<3>() + motion.row(3);
    if (turns) (*turns)[v] = motion.topRows<3>().cast<float>();
  };
  workers.for_chunks(guides_.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) place(v);
  });
  return result;
}

Points CoarseLevel::prolong(const RestShape& fine, const Workers& workers) const {
  return carried(fine.scaled_positions(), rest_pose(fine), pose(fine), workers, nullptr);
}

bool CoarseLevel::can_bend_like_fine() const {
  return (is_fine_eased() || static_cast<std::int32_t>(coarse_vertex_.size()) >= kLeastEased) &&
         shape_->weight_kind() != WeightKind::kUniform;
}

void CoarseLevel::bend_like_fine() {
  const double ratio = static_cast<double>(fine_vertex_.size()) / static_cast<double>(coarse_vertex_.size());
  solver_->set_bending(Field::Constant(1, bending_ * ratio));
}

std::size_t CoarseLevel::memory_bytes() const {
  return (fine_vertex_.capacity() + coarse_vertex_.capacity()) * sizeof(std::int32_t) +
         share_.capacity() * sizeof(double) + guides_.capacity() * sizeof(Guides) + shape_->memory_bytes() +
         solver_->memory_bytes() + (led_to_ ? led_to_->memory_bytes() : 0) +
         (alone_from_ ? alone_from_->size() * sizeof(double) : 0);
}

}  // namespace lpdeform
