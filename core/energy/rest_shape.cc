#include "core/energy/rest_shape.h"

#include <algorithm>

#include "core/base/check.h"

namespace lpdeform {
namespace {

template <typename T>
std::size_t bytes_of(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}

/// Both directions of every edge, row by row.
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

}  // namespace

absl::StatusOr<std::shared_ptr<const RestShape>> RestShape::create(const TriangleMesh& mesh,
                                                                   WeightKind kind) {
  MeshReport report = check_mesh(mesh);
  if (absl::Status status = deformable(report); !status.ok()) return status;

  const auto shape = std::shared_ptr<RestShape>(new RestShape);
  shape->positions_ = mesh.vertices;
  shape->faces_ = mesh.faces;
  shape->kind_ = kind;
  shape->components_ = connected_components(mesh);
  shape->component_count_ = static_cast<std::int32_t>(report.components);

  const EdgeWeights edges = edge_weights(mesh, kind);
  count_weight_defects(edges, report);
  shape->report_ = std::move(report);
  make_rows(shape->vertex_count(), edges, shape->offsets_, shape->neighbours_, shape->weights_);

  double total_length = 0;
  for (const auto& [u, v] : edges.edges) total_length += (mesh.vertices.row(u) - mesh.vertices.row(v)).norm();
  shape->mean_edge_length_ = total_length / static_cast<double>(edges.edges.size());
  shape->diagonal_ = (mesh.vertices.colwise().maxCoeff() - mesh.vertices.colwise().minCoeff()).norm();
  LPDEFORM_CHECK(shape->mean_edge_length_ > 0 && shape->diagonal_ > 0);

  shape->centre_ = mesh.vertices.colwise().mean();
  shape->scaled_positions_ = (mesh.vertices.rowwise() - shape->centre_) / shape->mean_edge_length_;
  return std::shared_ptr<const RestShape>(shape);
}

std::size_t RestShape::memory_bytes() const {
  return sizeof(*this) + (positions_.size() + scaled_positions_.size()) * sizeof(double) +
         faces_.size() * sizeof(std::int32_t) + bytes_of(components_) + bytes_of(offsets_) +
         bytes_of(neighbours_) + bytes_of(weights_);
}

}  // namespace lpdeform
