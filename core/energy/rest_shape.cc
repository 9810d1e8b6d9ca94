#include "core/energy/rest_shape.h"

#include <algorithm>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/base/check.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/mesh/half_edges.h"

namespace lpdeform {
namespace {

template <typename T>
std::size_t bytes_of(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}

/// Stores both directions of every edge, row by row.
void make_rows(std::int32_t vertex_count, const EdgeWeights& edges, std::vector<std::int32_t>& offsets,
               std::vector<std::int32_t>& neighbours, std::vector<double>& weights) {
  offsets.assign(vertex_count + 1, 0);
  for (const auto& [u, v] : edges.edges) ++offsets[u + 1], ++offsets[v + 1];
  for (std::int32_t i = 0; i < vertex_count; ++i) offsets[i + 1] += offsets[i];
  neighbours.resize(offsets.back());
  weights.resize(offsets.back());
  std::vector<std::int32_t> next(offsets.begin(), offsets.end() - 1);
  const auto append = [&](std::int32_t row, std::int32_t column, double weight) {
    neighbours[next[row]] = column;
    weights[next[row]++] = weight;
  };
  // Edges are sorted with the lower vertex first: all lower neighbours of a row come before its higher ones.
  for (std::size_t e = 0; e < edges.edges.size(); ++e)
    append(edges.edges[e][1], edges.edges[e][0], edges.weights[e]);
  for (std::size_t e = 0; e < edges.edges.size(); ++e)
    append(edges.edges[e][0], edges.edges[e][1], edges.weights[e]);
}

/// The bounding box and the mean of the vertices that faces use. Other vertices may lie anywhere.
struct Extent {
  Eigen::RowVector3d low = Eigen::RowVector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::RowVector3d high = -low;
  Eigen::RowVector3d mean = Eigen::RowVector3d::Zero();
};

Extent extent_of(const Points& positions, const std::vector<std::int32_t>& components) {
  Extent extent;
  double count = 0;
  for (Eigen::Index i = 0; i < positions.rows(); ++i) {
    if (components[i] < 0) continue;
    extent.low = extent.low.cwiseMin(positions.row(i));
    extent.high = extent.high.cwiseMax(positions.row(i));
    extent.mean += (positions.row(i) - extent.mean) / ++count;
  }
  return extent;
}

/// Within these limits, squares stay within the range of a double, and coordinates and energies within the range of a
/// float.
absl::Status check_scale(const Extent& extent) {
  const double largest = std::max(extent.low.cwiseAbs().maxCoeff(), extent.high.cwiseAbs().maxCoeff());
  if (largest > RestShape::kLargestCoordinate) {
    return make_fault(
        {Reason::kMeshScale, "", "|coordinate| <= 1e25"},
        absl::StrCat("The mesh's largest coordinate is ", largest, "; it may be at most 1e25."));
  }
  const double diagonal = (extent.high - extent.low).norm();
  if (diagonal < RestShape::kSmallestDiagonal) {
    return make_fault({Reason::kMeshScale, "", "diagonal >= 1e-25"},
                      absl::StrCat("The mesh's diagonal is ", diagonal, "; it must be 1e-25 or more."));
  }
  return absl::OkStatus();
}

/// Whether edge_weights can be called before the mesh has been checked.
bool has_weights(const TriangleMesh& mesh) {
  return mesh.faces.size() > 0 && mesh.faces.minCoeff() >= 0 &&
         mesh.faces.maxCoeff() < mesh.vertices.rows() && mesh.vertices.allFinite();
}

/// The mean length of the mesh's own edges, even if the weights have other edges.
double mean_length(const TriangleMesh& mesh, const EdgeWeights& weights) {
  double total = 0, count = 0;
  const auto add = [&](std::int32_t low, std::int32_t high) {
    total += (mesh.vertices.row(low) - mesh.vertices.row(high)).norm();
    ++count;
  };
  if (weights.flipped_edges.empty()) {
    for (const auto& [low, high] : weights.edges) add(low, high);
    return total / count;
  }
  const EdgeTable table(mesh.vertices.rows(), mesh.faces, [](Eigen::Index) { return true; });
  table.for_edges([&](std::int32_t low, std::int32_t high, std::span<const HalfEdge>) { add(low, high); });
  return total / count;
}

}  // namespace

absl::StatusOr<std::shared_ptr<const RestShape>> RestShape::create(const TriangleMesh& mesh, WeightKind kind,
                                                                   const Workers& workers) {
  MeshReport report;
  EdgeWeights edges;
  const bool is_at_once =
      workers.threads() > 1 && kind != WeightKind::kIntrinsicDelaunay && has_weights(mesh);
  const auto shape = std::shared_ptr<RestShape>(new RestShape);
  const auto find_edges = [&] {
    edges = edge_weights(mesh, kind);
    make_rows(static_cast<std::int32_t>(mesh.vertices.rows()), edges, shape->offsets_, shape->neighbours_,
              shape->weights_);
  };
  workers.run_both([&] { report = check_mesh(mesh); },
                   [&] {
                     if (!is_at_once) return;
                     find_edges();
                     shape->components_ = connected_components(mesh);
                   });
  if (absl::Status status = deformable(report); !status.ok()) return status;
  if (!is_at_once) shape->components_ = connected_components(mesh);
  const Extent extent = extent_of(mesh.vertices, shape->components_);
  if (absl::Status status = check_scale(extent); !status.ok()) return status;
  shape->positions_ = mesh.vertices;
  shape->faces_ = mesh.faces;
  shape->kind_ = kind;
  shape->component_count_ = static_cast<std::int32_t>(report.components);

  if (!is_at_once) find_edges();
  count_weight_defects(edges, report);
  shape->report_ = std::move(report);

  shape->mean_edge_length_ = mean_length(mesh, edges);
  shape->diagonal_ = (extent.high - extent.low).norm();
  shape->centre_ = extent.mean;
  LPDEFORM_CHECK(shape->mean_edge_length_ > 0 && shape->diagonal_ > 0);
  shape->scaled_positions_ = (mesh.vertices.rowwise() - shape->centre_) / shape->mean_edge_length_;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    if (shape->components_[i] < 0) shape->scaled_positions_.row(i).setZero();
  }
  return std::shared_ptr<const RestShape>(shape);
}

std::size_t RestShape::memory_bytes() const {
  return sizeof(*this) + (positions_.size() + scaled_positions_.size()) * sizeof(double) +
         faces_.size() * sizeof(std::int32_t) + bytes_of(components_) + bytes_of(offsets_) +
         bytes_of(neighbours_) + bytes_of(weights_);
}

}  // namespace lpdeform
