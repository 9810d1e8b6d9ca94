#include "client/cli/info_command.h"

#include <cstdio>

#include "client/cli/files/mesh_input.h"
#include "client/cli/report.h"

namespace lpdeform::cli {
namespace {

/// Which vertices each node draws: handles name vertices.
void print_parts(const gltf::Gltf& file) {
  for (const gltf::Part& part : file.parts()) {
    std::printf("node \"%s\", mesh \"%s\": vertices %td to %td\n", part.node.c_str(), part.mesh.c_str(),
                part.first, part.first + part.count - 1);
  }
}

}  // namespace

ExitStatus run_info(const InfoOptions& options) {
  const absl::StatusOr<AnyMeshFile> file = read_mesh_file(options.mesh);
  if (!file.ok()) return complain(file.status());
  print_left(*file);
  const absl::StatusOr<Weld> weld = weld_of(file->mesh, welding(*file, std::nullopt, false));
  if (!weld.ok()) return complain(said_of(options.mesh.string(), weld.status()));
  const MeshReport report = scattered(full_report(welded(file->mesh, *weld), WeightKind::kCotangent), *weld);
  client::MeshReport shown = to_client(report);
  shown.welded_vertices = weld->split_count() - weld->welded_count();
  std::fputs((options.is_json ? mesh_json(shown) : mesh_text(shown)).c_str(), stdout);
  if (!options.is_json && file->gltf) print_parts(*file->gltf);
  print_notices(shown);
  const absl::Status verdict = deformable(report);
  return verdict.ok() ? kDone : complain(said_of(options.mesh.string(), verdict));
}

}  // namespace lpdeform::cli
