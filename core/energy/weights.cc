#include "core/energy/weights.h"

#include <algorithm>
#include <numeric>

#include "core/energy/intrinsic_delaunay.h"
#include "core/mesh/half_edges.h"
#include "core/mesh/topology.h"

namespace lpdeform {
namespace {

constexpr double kFloor = 1e-6;  // relative to the mean weight
constexpr double kSliver = 1e3;  // times the median weight

std::array<double, 3> half_cotangents(const Points& vertices, const Eigen::Matrix<std::int32_t, 1, 3>& face) {
  const Eigen::RowVector3d a = vertices.row(face[0]), b = vertices.row(face[1]), c = vertices.row(face[2]);
  if (is_zero_area(a, b, c)) return {0, 0, 0};
  const double twice_area = (b - a).cross(c - a).norm();
  return {(b - a).dot(c - a) / twice_area / 2, (c - b).dot(a - b) / twice_area / 2,
          (a - c).dot(b - c) / twice_area / 2};
}

/// Appends an edge and clamps its weight.
void add_edge(std::array<std::int32_t, 2> edge, double weight, EdgeWeights& result) {
  if (weight < 0) result.clamped_edges.push_back(static_cast<std::int32_t>(result.edges.size()));
  result.edges.push_back(edge);
  result.weights.push_back(std::max(0.0, weight));
}

/// Each edge once: half the sum of the cotangents of the angles opposite it, clamped.
EdgeWeights cotangent_weights(const TriangleMesh& mesh) {
  std::vector<double> opposite(3 * mesh.faces.rows());  // of each half-edge
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    const std::array<double, 3> cotangents = half_cotangents(mesh.vertices, mesh.faces.row(f));
    for (int side = 0; side < 3; ++side) opposite[3 * f + side] = cotangents[(side + 2) % 3];
  }
  EdgeWeights result;
  const EdgeTable table(mesh.vertices.rows(), mesh.faces, [](Eigen::Index) { return true; });
  table.for_edges([&](std::int32_t low, std::int32_t high, std::span<const HalfEdge> sides) {
    double sum = 0;
    for (const HalfEdge& side : sides) sum += opposite[side.id];
    add_edge({low, high}, sum, result);
  });
  return result;
}

/// The mean weight without slivers: weights over 1000 times the median would dominate the mean.
double typical_weight(std::vector<double> weights) {
  const auto middle = weights.begin() + static_cast<std::ptrdiff_t>(weights.size() / 2);
  std::nth_element(weights.begin(), middle, weights.end());
  const double median = *middle;
  if (!(median > 0))
    return std::accumulate(weights.begin(), weights.end(), 0.0) / static_cast<double>(weights.size());
  const auto end =
      std::remove_if(weights.begin(), weights.end(), [&](double w) { return w > kSliver * median; });
  return std::accumulate(weights.begin(), end, 0.0) / static_cast<double>(end - weights.begin());
}

/// Raises the weights of edges that tie a nearly detached part of the surface (usually a single vertex) to the rest.
/// Such an edge joins two parts; its vertex in the smaller part counts as floored.
void apply_floor(std::int32_t vertex_count, EdgeWeights& result) {
  if (result.edges.empty()) return;
  const double floor = kFloor * typical_weight(result.weights);
  DisjointSets parts(vertex_count);
  for (std::size_t e = 0; e < result.edges.size(); ++e) {
    if (result.weights[e] >= floor) parts.unite(result.edges[e][0], result.edges[e][1]);
  }
  std::vector<std::int32_t> sizes(vertex_count, 0);
  for (std::int32_t vertex = 0; vertex < vertex_count; ++vertex) ++sizes[parts.find(vertex)];
  for (std::size_t e = 0; e < result.edges.size(); ++e) {
    const auto [u, v] = result.edges[e];
    if (result.weights[e] >= floor || parts.find(u) == parts.find(v)) continue;
    result.weights[e] = floor;
    result.floored_vertices.push_back(sizes[parts.find(u)] < sizes[parts.find(v)] ? u : v);
  }
  auto& floored = result.floored_vertices;
  std::sort(floored.begin(), floored.end());
  floored.erase(std::unique(floored.begin(), floored.end()), floored.end());
}

/// Each edge once: the sum of its weights in `all`, which is sorted, clamped.
EdgeWeights summed(const std::vector<WeightedEdge>& all) {
  EdgeWeights result;
  for (std::size_t begin = 0, end = 0; begin < all.size(); begin = end) {
    double sum = 0;
    for (end = begin; end < all.size() && all[end].edge == all[begin].edge; ++end) sum += all[end].weight;
    add_edge(all[begin].edge, sum, result);
  }
  return result;
}

bool has_zero_area_face(const TriangleMesh& mesh) {
  for (Eigen::Index f = 0; f < mesh.faces.rows(); ++f) {
    if (is_zero_area(mesh.vertices.row(mesh.faces(f, 0)), mesh.vertices.row(mesh.faces(f, 1)),
                     mesh.vertices.row(mesh.faces(f, 2))))
      return true;
  }
  return false;
}

}  // namespace

EdgeWeights edge_weights(const TriangleMesh& mesh, WeightKind kind) {
  EdgeWeights result = cotangent_weights(mesh);
  if (kind == WeightKind::kUniform) {
    std::fill(result.weights.begin(), result.weights.end(), 1.0);
    result.clamped_edges.clear();
  }
  if (kind == WeightKind::kIntrinsicDelaunay && (!result.clamped_edges.empty() || has_zero_area_face(mesh))) {
    IntrinsicDelaunay delaunay = intrinsic_delaunay(mesh);
    result = summed(delaunay.edges);
    result.flipped_edges = std::move(delaunay.flipped);
  }
  apply_floor(static_cast<std::int32_t>(mesh.vertices.rows()), result);
  return result;
}

void count_weight_defects(const EdgeWeights& weights, MeshReport& report) {
  report.clamped_edges = {};
  report.clamped_edges.count = static_cast<std::int64_t>(weights.clamped_edges.size());
  for (std::size_t k = 0; k < weights.clamped_edges.size() && k < DefectCount::kFirstShown; ++k) {
    const auto& edge = weights.edges[weights.clamped_edges[k]];
    report.clamped_edges.first.insert(report.clamped_edges.first.end(), edge.begin(), edge.end());
  }
  report.flipped_edges = {};
  report.flipped_edges.count = static_cast<std::int64_t>(weights.flipped_edges.size());
  for (std::size_t k = 0; k < weights.flipped_edges.size() && k < DefectCount::kFirstShown; ++k) {
    const auto& edge = weights.flipped_edges[k];
    report.flipped_edges.first.insert(report.flipped_edges.first.end(), edge.begin(), edge.end());
  }
  report.floored_vertices = {};
  report.floored_vertices.count = static_cast<std::int64_t>(weights.floored_vertices.size());
  const auto shown = std::min<std::size_t>(weights.floored_vertices.size(), DefectCount::kFirstShown);
  report.floored_vertices.first.assign(weights.floored_vertices.begin(),
                                       weights.floored_vertices.begin() + shown);
}

}  // namespace lpdeform
