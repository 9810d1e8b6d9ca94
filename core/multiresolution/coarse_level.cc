#include "core/multiresolution/coarse_level.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/energy/cell_pass.h"
#include "core/multiresolution/coarse_handles.h"

namespace lpdeform {
namespace {

constexpr std::size_t kChunk = 4096;  // vertices

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
                                                 MakeLevelSolver make_solver) {
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
  level->make_solver_ = std::move(make_solver);
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

absl::Status CoarseLevel::take_over(const RestShape& fine, const HandleSet& handles,
                                    const Constraints& constraints, const Material& material,
                                    double bending) {
  if (!solver_) solver_ = make_solver_(shape_);
  if (!solver_) return absl::InternalError("The solver of a coarse level could not be made again.");
  const std::size_t n = fine_vertex_.size();
  Material coarse{restricted(material.p, fine_vertex_), restricted(material.stiffness, fine_vertex_),
                  material.length_unit > 0 ? material.length_unit : fine.mean_edge_length()};
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
  bending_ = bending;
  solver_->set_bending(bending);
  absl::Status status = solver_->set_material(coarse);
  status.Update(solver_->set_handles(
      coarse_handles({fine, *shape_, fine_vertex_, coarse_vertex_}, handles, constraints)));
  return status;
}

Points CoarseLevel::prolong(const RestShape& fine, const Workers& workers) const {
  const Points coarse = (solver_->positions().rowwise() - shape_->centre()) / shape_->mean_edge_length();
  CellPass cells(shape_, workers);
  cells.evaluate(coarse, LpNorm(Material::uniform(2), shape_->vertex_count(), 1, 1));
  const std::vector<Eigen::Matrix3d> rotations = cells.rotations();

  const double unit = fine.mean_edge_length();
  const Points moved = (solver_->positions().rowwise() - fine.centre()) / unit;
  Points result(fine.vertex_count(), 3);
  const auto place = [&](Eigen::Index v) {
    const Eigen::RowVector3d rest = fine.scaled_positions().row(v);
    Eigen::RowVector3d sum = Eigen::RowVector3d::Zero();
    const Guides& guides = guides_[static_cast<std::size_t>(v)];
    for (std::size_t k = 0; k < kGuides; ++k) {
      const std::int32_t c = guides.vertex[k];
      if (guides.weight[k] == 0) continue;
      const Eigen::RowVector3d offset = rest - fine.scaled_positions().row(fine_vertex_[c]);
      sum += guides.weight[k] * (moved.row(c) + offset * rotations[c].transpose());
    }
    result.row(v) = sum;
  };
  workers.for_chunks(guides_.size(), kChunk, [&](std::size_t, std::size_t begin, std::size_t end) {
    for (std::size_t v = begin; v < end; ++v) place(static_cast<Eigen::Index>(v));
  });
  return result;
}

bool CoarseLevel::can_bend_like_fine() const {
  return (bending_ < 1 || coarse_vertex_.size() >= kLeastEased) &&
         shape_->weight_kind() != WeightKind::kUniform;
}

void CoarseLevel::bend_like_fine() {
  const double ratio = static_cast<double>(fine_vertex_.size()) / static_cast<double>(coarse_vertex_.size());
  solver_->set_bending(bending_ * ratio);
}

void CoarseLevel::leave() {
  if (leaves()) solver_.reset();
}

std::size_t CoarseLevel::memory_bytes() const {
  return (fine_vertex_.capacity() + coarse_vertex_.capacity()) * sizeof(std::int32_t) +
         share_.capacity() * sizeof(double) + guides_.capacity() * sizeof(Guides) + shape_->memory_bytes() +
         (solver_ && !leaves() ? solver_->memory_bytes() : 0);
}

}  // namespace lpdeform
