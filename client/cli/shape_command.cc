#include "client/cli/shape_command.h"

#include <array>
#include <cstdio>

#include "client/cli/files/outputs.h"
#include "client/cli/files/text_file.h"
#include "client/cli/generated_shape.h"

namespace lpdeform::cli {
namespace {

absl::Status write_shape(const ShapeOptions& options) {
  absl::Status status = check_outputs(std::array{options.out});
  if (status.ok() && options.handles) status = check_folder(*options.handles);
  if (status.ok() && options.handles)
    status = check_apart(std::array{NamedFile{"--handles", *options.handles}},
                         std::array{NamedFile{"--out", options.out}});
  if (!status.ok()) return status;
  const absl::StatusOr<GeneratedShape> shape = options.vertices
                                                   ? generate_shape_of(options.name, *options.vertices)
                                                   : generate_shape(options.name, options.detail);
  if (!shape.ok()) return shape.status();
  status = write_output(options.out, {{shape->mesh, ""}, {}}, shape->mesh.vertices, {}, {});
  if (!status.ok()) return status;
  std::printf("%s: %td vertices, %td faces\n", options.out.c_str(), shape->mesh.vertices.rows(),
              shape->mesh.faces.rows());
  if (!options.handles) return absl::OkStatus();
  status = write_text(*options.handles,
                      handle_file_text(shape->handles, options.out.filename().string(), shape->note));
  if (status.ok()) std::printf("%s: %s\n", options.handles->c_str(), shape->note.c_str());
  return status;
}

}  // namespace

ExitStatus run_shape(const ShapeOptions& options) {
  const absl::Status written = write_shape(options);
  return written.ok() ? kDone : complain(written);
}

}  // namespace lpdeform::cli
