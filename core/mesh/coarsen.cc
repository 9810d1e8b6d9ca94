#include "core/mesh/coarsen.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/mesh/collapsible_mesh.h"

namespace lpdeform {
namespace {

using HalfEdgeMesh = CollapsibleMesh;
using HalfEdge = OpenMesh::SmartHalfedgeHandle;
using OpenMesh::Vec3d;

constexpr double kGrowth = 1.2;  // factor from round to round of the longest edge to collapse
constexpr unsigned kLargestValence = 10;
constexpr double kLargestTurn = 0.5;  // the cosine

bool may_collapse(HalfEdgeMesh& mesh, HalfEdge half_edge) {
  if (half_edge.from().is_boundary() && !half_edge.edge().is_boundary()) return false;
  if (half_edge.from().valence() + half_edge.to().valence() > kLargestValence + 4) return false;
  return mesh.is_collapse_ok(half_edge) && keeps_orientation(mesh, half_edge, kLargestTurn);
}

/// One round; `left` counts vertices.
void collapse_up_to(HalfEdgeMesh& mesh, double longest, std::int32_t vertices, std::int32_t& left,
                    std::vector<std::int32_t>& went_into) {
  for (const auto edge : mesh.edges()) {
    if (left <= vertices) return;
    if (edge.deleted() || mesh.calc_edge_sqr_length(edge) > longest * longest) continue;
    for (const auto half_edge : {edge.h0(), edge.h1()}) {
      if (!may_collapse(mesh, half_edge)) continue;
      went_into[half_edge.from().idx()] = half_edge.to().idx();
      mesh.collapse(half_edge);
      --left;
      break;
    }
  }
}

std::vector<std::int32_t> collapse(HalfEdgeMesh& mesh, std::int32_t vertices) {
  std::vector<std::int32_t> went_into(mesh.n_vertices());
  std::iota(went_into.begin(), went_into.end(), 0);
  std::vector<double> lengths;
  for (const auto edge : mesh.edges()) lengths.push_back(mesh.calc_edge_length(edge));
  if (lengths.empty()) return went_into;
  std::nth_element(lengths.begin(), lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 8),
                   lengths.end());
  double longest = lengths[lengths.size() / 8];
  auto left = static_cast<std::int32_t>(mesh.n_vertices());
  for (int idle = 0; left > vertices && idle < 8; longest *= kGrowth) {
    const std::int32_t before = left;
    collapse_up_to(mesh, longest, vertices, left, went_into);
    idle = before - left > left / 100 ? 0 : idle + 1;
  }
  return went_into;
}

}  // namespace

std::size_t CoarseMesh::memory_bytes() const {
  return static_cast<std::size_t>(mesh.vertices.size()) * sizeof(double) +
         (static_cast<std::size_t>(mesh.faces.size()) + fine_vertex.capacity() + coarse_vertex.capacity()) *
             sizeof(std::int32_t);
}

CoarseMesh coarsen(const TriangleMesh& mesh, std::int32_t vertices) {
  HalfEdgeMesh half_edges = to_collapsible(mesh);
  std::vector<std::int32_t> went_into = collapse(half_edges, vertices);
  for (std::int32_t& into : went_into) {
    while (into != went_into[into]) into = went_into[into];
  }

  CoarseMesh result;
  std::vector<std::int32_t> place(went_into.size(), -1);
  for (std::size_t v = 0; v < went_into.size(); ++v) {
    if (went_into[v] != static_cast<std::int32_t>(v)) continue;
    place[v] = static_cast<std::int32_t>(result.fine_vertex.size());
    result.fine_vertex.push_back(static_cast<std::int32_t>(v));
  }
  result.coarse_vertex.resize(went_into.size());
  for (std::size_t v = 0; v < went_into.size(); ++v) result.coarse_vertex[v] = place[went_into[v]];
  result.mesh.vertices.resize(static_cast<Eigen::Index>(result.fine_vertex.size()), 3);
  for (std::size_t c = 0; c < result.fine_vertex.size(); ++c) {
    result.mesh.vertices.row(static_cast<Eigen::Index>(c)) = mesh.vertices.row(result.fine_vertex[c]);
  }
  std::vector<std::int32_t> corners;
  for (const auto face : half_edges.faces()) {
    for (const auto vertex : face.vertices()) corners.push_back(place[vertex.idx()]);
  }
  result.mesh.faces =
      Eigen::Map<const Faces>(corners.data(), static_cast<Eigen::Index>(corners.size() / 3), 3);
  return result;
}

}  // namespace lpdeform
