#include "core/multiresolution/coarse_level.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/multiresolution/coarse_handles.h"

namespace lpdeform {
namespace {

constexpr std::size_t kChunk = 4096;  // vertices

/// A level that leads makes kLeadingWork / vertices iterations for a move, within these bounds.
constexpr std::int32_t kLeadingWork = 70000;
constexpr std::int32_t kLeastLeading = 4, kMostLeading = 100;
constexpr double kLeadingTolerance = 1e-3;

/// The field at the coarse vertices; a single value stays a single value.
Field restricted(const Field& field, const std::vector<std::int32_t>& fine_vertex) {
  if (field.size() == 1) return field;
  Field result(static_cast<Eigen::Index>(fine_vertex.size()));
  for (std::size_t c = 0; c < fine_vertex.size(); ++c)
    result[static_cast<Eigen::Index>(c)] = field[fine_vertex[c]];
  return result;
}

double at(const Field& field, Eigen::Index i) {
  return field.size() == 1 ? field[0] : field[i];
}

}  // namespace

CoarseMesh CoarseLevel::coarsened(const RestShape& fine) {
  return coarsen({fine.positions(), fine.faces()}, fine.vertex_count() / kRatio);
}

std::unique_ptr<CoarseLevel> CoarseLevel::create(const RestShape& fine, CoarseMesh coarse,
                                                 const MakeLevelSolver& make_solver) {
  if (2 * coarse.mesh.vertices.rows() > fine.vertex_count() || coarse.mesh.faces.rows() == 0) return nullptr;
  auto shape = RestShape::create(coarse.mesh, fine.weight_kind());
  if (!shape.ok()) return nullptr;
  std::unique_ptr<LevelSolver> solver = make_solver(*shape);
  if (!solver) return nullptr;
  std::unique_ptr<CoarseLevel> level(new CoarseLevel);
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
/// the nearest kGuides. They are weighted so that the weight of the next nearest would be 0.
void CoarseLevel::find_guides(const RestShape& fine) {
  const double unit = shape_->mean_edge_length() / fine.mean_edge_length();
  const double least = 1e-3 * unit;
  guides_.resize(coarse_vertex_.size());
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
    std::sort(near.begin(), near.end());
    const double farthest = near.size() > kGuides ? near[kGuides].first : near.back().first * 1.5 + unit;
    Guides guides{};
    guides.vertex.fill(own);
    double sum = 0;
    for (std::size_t k = 0; k < std::min(kGuides, near.size()); ++k) {
      guides.vertex[k] = near[k].second;
      const double weight = 1 / (near[k].first + least) - 1 / (farthest + least);
      sum += guides.weight[k] = weight * weight;
    }
    if (!(sum > 0)) sum = guides.weight[0] = 1;
    for (double& weight : guides.weight) weight /= sum;
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
          std::clamp(at(coarse.stiffness, i) * std::pow(share_[c] / kRatio, 1 - at(coarse.p, i) / 2),
                     Material::kLowestStiffness, Material::kHighestStiffness);
    }
    coarse.stiffness = std::move(stiffness);
  }
  bending_ = fine.bending;
  absl::Status status = solver_->set_material(coarse);
  status.Update(solver_->set_handles(
      coarse_handles({fine.shape, *shape_, fine_vertex_, coarse_vertex_}, fine.handles, fine.constraints)));
  return status;
}

absl::Status CoarseLevel::take_over(const FineInputs& fine) {
  solver_->set_bending(fine.bending);
  return restrict_inputs(fine);
}

bool CoarseLevel::can_lead(const RestShape& fine, double bending) {
  return fine.vertex_count() >= (bending < 1 ? kLeastEasedLevel : kLeastEased) &&
         fine.weight_kind() != WeightKind::kUniform;
}

std::optional<CoarseMotion> CoarseLevel::lead(const FineInputs& fine, const Points* from,
                                              const Workers& workers, std::stop_token stop) {
  const Pose before = from ? pose(fine.shape) : rest_pose(fine.shape);
  if (!restrict_inputs(fine).ok()) return std::nullopt;
  bend_like_fine();
  SolveSettings settings;
  settings.initial = InitialGuess::kCurrent;
  settings.method = Method::kQuasiNewton;
  settings.tolerance = kLeadingTolerance;
  settings.effort = 0;
  settings.keep_trace = false;
  settings.max_iterations = std::clamp(kLeadingWork / shape_->vertex_count(), kLeastLeading, kMostLeading);
  if (!solver_->start(settings, std::move(stop)).ok()) return std::nullopt;
  while (solver_->step()) {
  }
  CoarseMotion motion;
  motion.positions =
      carried(from ? *from : fine.shape.scaled_positions(), before, pose(fine.shape), workers, &motion.turns);
  return motion;
}

absl::Status CoarseLevel::go_to(const FineInputs& fine, const Points& x) {
  absl::Status status = restrict_inputs(fine);
  bend_like_fine();
  Points positions(static_cast<Eigen::Index>(fine_vertex_.size()), 3);
  for (std::size_t c = 0; c < fine_vertex_.size(); ++c) {
    positions.row(static_cast<Eigen::Index>(c)) =
        x.row(fine_vertex_[c]) * fine.shape.mean_edge_length() + fine.shape.centre();
  }
  status.Update(solver_->set_positions(positions));
  return status;
}

CoarseLevel::Pose CoarseLevel::rest_pose(const RestShape& fine) const {
  Pose rest{Points(static_cast<Eigen::Index>(fine_vertex_.size()), 3),
            std::vector<Eigen::Matrix3d>(fine_vertex_.size(), Eigen::Matrix3d::Identity())};
  for (std::size_t c = 0; c < fine_vertex_.size(); ++c)
    rest.positions.row(static_cast<Eigen::Index>(c)) = fine.scaled_positions().row(fine_vertex_[c]);
  return rest;
}

CoarseLevel::Pose CoarseLevel::pose(const RestShape& fine) const {
  return {(solver_->positions().rowwise() - fine.centre()) / fine.mean_edge_length(), solver_->rotations()};
}

/// The fine surface `from`, moved as its guides have moved from one coarse state to another. With `turns`, writes them too.
Points CoarseLevel::carried(const Points& from, const Pose& before, const Pose& now, const Workers& workers,
                            std::vector<Eigen::Matrix3d>* turns) const {
  std::vector<Eigen::Matrix3d> coarse_turns(fine_vertex_.size());
  for (std::size_t c = 0; c < coarse_turns.size(); ++c)
    coarse_turns[c] = before.rotations[c] * now.rotations[c].transpose();
  Points result(from.rows(), 3);
  if (turns) turns->resize(static_cast<std::size_t>(from.rows()));
  const auto place = [&](std::size_t v) {
    const auto row = static_cast<Eigen::Index>(v);
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
    const Guides& guides = guides_[v];
    for (std::size_t k = 0; k < kGuides; ++k) {
      const std::int32_t c = guides.vertex[k];
      if (guides.weight[k] == 0) continue;
      const Eigen::RowVector3d offset = from.row(row) - before.positions.row(c);
      sum += guides.weight[k] * (now.positions.row(c) + offset * coarse_turns[c]);
      turn += guides.weight[k] * coarse_turns[c];
    }
    result.row(row) = sum;
    if (turns) (*turns)[v] = turn;
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
  return (bending_ < 1 || static_cast<std::int32_t>(coarse_vertex_.size()) >= kLeastEased) &&
         shape_->weight_kind() != WeightKind::kUniform;
}

void CoarseLevel::bend_like_fine() {
  const double ratio = static_cast<double>(fine_vertex_.size()) / static_cast<double>(coarse_vertex_.size());
  solver_->set_bending(bending_ * ratio);
}

std::size_t CoarseLevel::memory_bytes() const {
  return (fine_vertex_.capacity() + coarse_vertex_.capacity()) * sizeof(std::int32_t) +
         share_.capacity() * sizeof(double) + guides_.capacity() * sizeof(Guides) + shape_->memory_bytes() +
         solver_->memory_bytes();
}

}  // namespace lpdeform
