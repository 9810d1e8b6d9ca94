#include "core/shapes/collapsible_mesh.h"

namespace lpdeform {

CollapsibleMesh to_collapsible(const TriangleMesh& mesh) {
  CollapsibleMesh result;
  const auto n = static_cast<std::size_t>(mesh.vertices.rows()),
             m = static_cast<std::size_t>(mesh.faces.rows());
  result.reserve(n, n + m, m);
  for (const auto& row : mesh.vertices.rowwise()) result.add_vertex(OpenMesh::Vec3d(row[0], row[1], row[2]));
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

bool keeps_orientation(const CollapsibleMesh& mesh, OpenMesh::SmartHalfedgeHandle half_edge, double cosine) {
  const OpenMesh::Vec3d target = mesh.point(half_edge.to());
  const auto origin = half_edge.from();
  for (const auto out : origin.outgoing_halfedges()) {
    if (out.is_boundary()) continue;
    const auto b = out.to(), c = out.next().to();
    if (b == half_edge.to() || c == half_edge.to()) continue;
    const OpenMesh::Vec3d from = mesh.point(out.from());
    const OpenMesh::Vec3d before = (mesh.point(b) - from).cross(mesh.point(c) - from);
    const OpenMesh::Vec3d after = (mesh.point(b) - target).cross(mesh.point(c) - target);
    // A sliver may turn, since it has no direction to keep, but no face may become one.
    if (!(after.sqrnorm() > 0) || before.dot(after) < cosine * before.norm() * after.norm()) return false;
  }
  return true;
}

}  // namespace lpdeform
