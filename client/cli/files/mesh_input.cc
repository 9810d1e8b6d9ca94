#include "client/cli/files/mesh_input.h"

#include <algorithm>
#include <cstdio>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "client/cpp/mesh_notices.h"
#include "core/base/fault.h"

namespace lpdeform::cli {

absl::Status said_of(const std::string& what, const absl::Status& error) {
  if (absl::StrContains(error.message(), what)) return error;
  return carry_fault(error.code(), fault_of(error), absl::StrCat(what, ": ", error.message()));
}

absl::StatusOr<AnyMeshFile> read_mesh_file(const std::filesystem::path& path) {
  absl::StatusOr<AnyMeshFile> file = read_any_mesh(path);
  if (!file.ok()) return said_of(path.string(), file.status());
  return file;
}

std::optional<double> welding(const AnyMeshFile& file, std::optional<double> asked, bool is_off) {
  if (asked || is_off || !file.splits_vertices()) return asked;
  return 0;
}

void print_left(const AnyMeshFile& file) {
  if (!file.gltf) return;
  for (const std::string& notice : file.gltf->notices())
    std::fprintf(stderr, "lpdeform: %s\n", notice.c_str());
}

absl::StatusOr<AnyMeshFile> read_deformable(const std::filesystem::path& path) {
  absl::StatusOr<AnyMeshFile> file = read_mesh_file(path);
  if (!file.ok()) return file;
  const absl::Status verdict = deformable(check_mesh(file->mesh));
  if (!verdict.ok()) return said_of(path.string(), verdict);
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
  out.notices = client::mesh_notices(out.defects);
  return out;
}

absl::StatusOr<Weld> weld_of(const TriangleMesh& mesh, std::optional<double> tolerance) {
  if (tolerance) return weld_by_position(mesh.vertices, *tolerance);
  return no_weld(static_cast<std::int32_t>(mesh.vertices.rows()));
}

client::Weld by_position(std::optional<double> tolerance) {
  return {.by_position = tolerance.has_value(), .tolerance = tolerance.value_or(0), .groups = {}};
}

void print_notices(const client::MeshReport& report) {
  for (const std::string& notice : report.notices)
    std::fprintf(stderr, "lpdeform: %s In this program use --weld of deform and resize.\n", notice.c_str());
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
