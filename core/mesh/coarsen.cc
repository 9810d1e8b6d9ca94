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

constexpr double kGrowth = 1.2;  // of the longest edge collapsed, from round to round
constexpr unsigned kLargestValence = 10;
constexpr double kLargestTurn = 0.5;  // the cosine

HalfEdgeMesh to_half_edges(const TriangleMesh& mesh) {
  HalfEdgeMesh result;
  const auto n = static_cast<std::size_t>(mesh.vertices.rows()),
             m = static_cast<std::size_t>(mesh.faces.rows());
  result.reserve(n, n + m, m);
  for (const auto& row : mesh.vertices.rowwise()) result.add_vertex(Vec3d(row[0], row[1], row[2]));
  for (const auto& row : mesh.faces.rowwise()) {
    const auto vertex = [&](int corner) { return result.vertex_handle(static_cast<unsigned>(row[corner])); };
    const bool is_open = [&] {
      for (int corner = 0; corner < 3; ++corner) {
        const auto from = vertex(corner), to = vertex((corner + 1) % 3);
        if (from == to || !result.is_boundary(from)) return false;
        const auto present = result.find_halfedge(from, to);
        if (present.is_valid() && !result.is_boundary(present)) return false;
      }
      return true;
    }();
    if (is_open) result.add_face(vertex(0), vertex(1), vertex(2));
  }
  return result;
}

/// Whether the faces that stay when the half-edge collapses into its target still look the way they did.
bool keeps_orientation(const HalfEdgeMesh& mesh, HalfEdge half_edge) {
  const Vec3d target = mesh.point(half_edge.to());
  for (const auto out : half_edge.from().outgoing_halfedges()) {
    if (out.is_boundary()) continue;
    const auto b = out.to(), c = out.next().to();
    if (b == half_edge.to() || c == half_edge.to()) continue;
    const Vec3d side = mesh.point(c) - mesh.point(b);
    const Vec3d before = side.cross(mesh.point(out.from()) - mesh.point(b)),
                after = side.cross(target - mesh.point(b));
    if (!(before.dot(after) > kLargestTurn * before.norm() * after.norm())) return false;
  }
  return true;
}

bool may_collapse(HalfEdgeMesh& mesh, HalfEdge half_edge) {
  if (half_edge.from().is_boundary() && !half_edge.edge().is_boundary()) return false;
  if (half_edge.from().valence() + half_edge.to().valence() > kLargestValence + 4) return false;
  return mesh.is_collapse_ok(half_edge) && keeps_orientation(mesh, half_edge);
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

CoarseMesh coarsen(const TriangleMesh& mesh, std::int32_t vertices) {
  HalfEdgeMesh half_edges = to_half_edges(mesh);
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
