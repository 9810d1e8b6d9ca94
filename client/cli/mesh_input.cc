#include "client/cli/mesh_input.h"

#include <algorithm>

namespace lpdeform::cli {

absl::StatusOr<MeshFile> read_deformable(const std::filesystem::path& path) {
  absl::StatusOr<MeshFile> file = read_mesh(path);
  if (!file.ok()) return file;
  const absl::Status verdict = deformable(check_mesh(file->mesh));
  if (!verdict.ok()) return verdict;
  return file;
}

MeshReport full_report(const TriangleMesh& mesh, WeightKind weights) {
  MeshReport report = check_mesh(mesh);
  if (deformable(report).ok()) count_weight_defects(edge_weights(mesh, weights), report);
  return report;
}

client::Mesh to_client(const TriangleMesh& mesh) {
  client::Mesh out;
  out.vertices = flat(mesh.vertices);
  out.faces.assign(mesh.faces.data(), mesh.faces.data() + mesh.faces.size());
  return out;
}

client::MeshReport to_client(const MeshReport& report) {
  client::MeshReport out{.vertices = report.vertices,
                         .faces = report.faces,
                         .edges = report.edges,
                         .components = report.components,
                         .boundary_loops = report.boundary_loops,
                         .defects = {},
                         .welded_vertices = 0};
  for (const Defect defect : all_defects()) {
    const DefectCount& found = report.of(defect);
    out.defects.push_back({std::string(defect_name(defect)), found.count, found.first});
  }
  return out;
}

std::vector<double> flat(const Points& points) {
  return {points.data(), points.data() + points.size()};
}

Points points_of(std::span<const double> numbers) {
  Points points(static_cast<Eigen::Index>(numbers.size() / 3), 3);
  std::copy_n(numbers.data(), points.size(), points.data());
  return points;
}

}  // namespace lpdeform::cli
