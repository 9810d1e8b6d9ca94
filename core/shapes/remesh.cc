#include "core/shapes/remesh.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/shapes/collapsible_mesh.h"

namespace lpdeform {
namespace {

using HalfEdgeMesh = CollapsibleMesh;
using OpenMesh::Vec3d;

constexpr double kLargestTurn = 0.2;  // the cosine

TriangleMesh to_triangles(const HalfEdgeMesh& mesh) {
  TriangleMesh result;
  result.vertices.resize(static_cast<Eigen::Index>(mesh.n_vertices()), 3);
  for (const auto vertex : mesh.vertices()) {
    for (int axis = 0; axis < 3; ++axis) result.vertices(vertex.idx(), axis) = mesh.point(vertex)[axis];
  }
  result.faces.resize(static_cast<Eigen::Index>(mesh.n_faces()), 3);
  for (const auto face : mesh.faces()) {
    int corner = 0;
    for (const auto vertex : face.vertices()) result.faces(face.idx(), corner++) = vertex.idx();
  }
  return result;
}

Vec3d normal(const Vec3d& a, const Vec3d& b, const Vec3d& c) {
  return (b - a).cross(c - a);
}

bool collapse_short_edges(HalfEdgeMesh& mesh, double shortest_edge) {
  bool is_changed = false;
  for (const auto edge : mesh.edges()) {
    if (edge.deleted() || mesh.calc_edge_length(edge) >= shortest_edge) continue;
    for (const auto half_edge : {edge.h0(), edge.h1()}) {
      if (!mesh.is_collapse_ok(half_edge) || !keeps_orientation(mesh, half_edge, kLargestTurn)) continue;
      mesh.collapse(half_edge);
      is_changed = true;
      break;
    }
  }
  mesh.garbage_collection();
  return is_changed;
}

double angle_at(const HalfEdgeMesh& mesh, OpenMesh::VertexHandle tip, OpenMesh::VertexHandle a,
                OpenMesh::VertexHandle b) {
  const Vec3d u = mesh.point(a) - mesh.point(tip), v = mesh.point(b) - mesh.point(tip);
  return std::atan2(u.cross(v).norm(), u.dot(v));
}

/// Flips an edge if the angles opposite it add up to more than 180 degrees and the surface does not fold.
void flip_towards_delaunay(HalfEdgeMesh& mesh) {
  for (const auto edge : mesh.edges()) {
    const auto a = edge.h0().from(), b = edge.h0().to();
    const auto c = edge.h0().next().to(), d = edge.h1().next().to();
    constexpr double kHalfTurn = 3.14159265358979;
    if (angle_at(mesh, c, a, b) + angle_at(mesh, d, a, b) <= kHalfTurn || !mesh.is_flip_ok(edge)) continue;
    const Vec3d first = normal(mesh.point(c), mesh.point(a), mesh.point(d));
    const Vec3d second = normal(mesh.point(d), mesh.point(b), mesh.point(c));
    if (first.dot(second) > 0.5 * first.norm() * second.norm()) mesh.flip(edge);
  }
}

Eigen::RowVector3d onto_surface(Eigen::RowVector3d point, const ImplicitField& field, double step) {
  for (int round = 0; round < 3; ++round) {
    const double value = field(point);
    Eigen::RowVector3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::RowVector3d ahead = point;
      ahead[axis] += step;
      gradient[axis] = (field(ahead) - value) / step;
    }
    point -= value * gradient / std::max(gradient.squaredNorm(), 0.1);
  }
  return point;
}

void smooth(HalfEdgeMesh& mesh, const ImplicitField& field, double step) {
  std::vector<Vec3d> moved;
  moved.reserve(mesh.n_vertices());
  for (const auto vertex : mesh.vertices()) {
    Vec3d sum(0, 0, 0);
    for (const auto neighbour : vertex.vertices()) sum += mesh.point(neighbour);
    const Vec3d mean = 0.5 * mesh.point(vertex) + 0.5 * sum / static_cast<double>(vertex.valence());
    const Eigen::RowVector3d point = onto_surface({mean[0], mean[1], mean[2]}, field, step);
    moved.emplace_back(point[0], point[1], point[2]);
  }
  for (const auto vertex : mesh.vertices()) mesh.set_point(vertex, moved[vertex.idx()]);
}

}  // namespace

TriangleMesh remesh(const TriangleMesh& mesh, const ImplicitField& field, double shortest_edge, int rounds) {
  HalfEdgeMesh half_edges = to_collapsible(mesh);
  while (collapse_short_edges(half_edges, shortest_edge)) {
  }
  for (int round = 0; round < rounds; ++round) {
    flip_towards_delaunay(half_edges);
    smooth(half_edges, field, 1e-4 * shortest_edge);
  }
  return to_triangles(half_edges);
}

}  // namespace lpdeform
