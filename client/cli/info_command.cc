#include "client/cli/info_command.h"

#include <cstdio>

#include "client/cli/files/mesh_input.h"
#include "client/cli/report.h"

namespace lpdeform::cli {

ExitStatus run_info(const InfoOptions& options) {
  const absl::StatusOr<MeshFile> file = read_mesh_file(options.mesh);
  if (!file.ok()) return complain(file.status());
  const MeshReport report = full_report(file->mesh, WeightKind::kCotangent);
  const client::MeshReport shown = to_client(report);
  std::fputs((options.is_json ? mesh_json(shown) : mesh_text(shown)).c_str(), stdout);
  print_notices(shown);
  const absl::Status verdict = deformable(report);
  return verdict.ok() ? kDone : complain(said_of(options.mesh.string(), verdict));
}

}  // namespace lpdeform::cli
