#include "client/cli/resize_command.h"

#include <array>
#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "client/cli/files/mesh_input.h"
#include "client/cli/files/outputs.h"
#include "client/cli/interrupt.h"
#include "client/cli/local_server.h"
#include "client/cli/progress.h"
#include "client/cpp/client.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/mesh/weld.h"
#include "core/resize/resize.h"
#include "core/resize/resize_extents.h"
#include "core/resize/sparing.h"

namespace lpdeform::cli {
namespace {

/// The mesh as resized so far, and the result of the last solve.
struct Resized {
  MeshFile file;
  Field distortion;
  client::StopReason stop_reason = client::StopReason::kConverged;
};

Eigen::Vector3d vector_of(const std::vector<double>& numbers, const Eigen::Vector3d& otherwise) {
  return numbers.size() == 3 ? Eigen::Vector3d(numbers[0], numbers[1], numbers[2]) : otherwise;
}

std::array<double, 3> array_of(const Eigen::Vector3d& vector) {
  return {vector[0], vector[1], vector[2]};
}

absl::StatusOr<Scaling> read_scaling(const ResizeOptions& options, const TriangleMesh& mesh) {
  if (options.x_axis.empty() != options.y_axis.empty()) {
    return make_fault({Reason::kResizeAxes, "axes", "both or none"},
                      "One of --x-axis and --y-axis is given without the other.");
  }
  const auto shape = RestShape::create(mesh);
  if (!shape.ok()) return shape.status();
  Scaling scaling;
  scaling.scale = vector_of(options.scale, Eigen::Vector3d::Ones());
  scaling.origin = vector_of(options.origin, box_middle(**shape));
  const auto axes = axes_of(vector_of(options.x_axis, Eigen::Vector3d::UnitX()),
                            vector_of(options.y_axis, Eigen::Vector3d::UnitY()));
  if (!axes.ok()) return axes.status();
  scaling.axes = *axes;
  if (absl::Status status = check_scaling(scaling); !status.ok()) return status;
  const double stretch = scaling.scale.maxCoeff() / shared_factor(scaling.scale);
  if (stretch <= Scaling::kHighest) return scaling;
  return make_fault({Reason::kResizeScaleOutOfRange, "scale", "100 times the least of the three"},
                    absl::StrCat("The largest factor is ", stretch,
                                 " times the least; it must be at most 100 times the least."));
}

/// For each welded vertex its first copy, in the mesh that is not welded.
std::vector<std::uint32_t> first_copies(const std::vector<std::int32_t>& vertices, const Weld& weld) {
  std::vector<std::uint32_t> copies;
  for (const std::int32_t vertex : vertices)
    copies.push_back(static_cast<std::uint32_t>(weld.first_copy[vertex]));
  return copies;
}

client::FieldValue field_value(const Field& field, const Weld& weld) {
  if (field.size() == 1) return field[0];
  const Field split = scattered(field, weld);
  return std::vector<double>(split.begin(), split.end());
}

/// The update that makes a server stretch the shape along one axis. It holds the ends of spared components
/// along that axis, and their sides in their planes.
absl::StatusOr<client::Update> update_for(const std::shared_ptr<const RestShape>& shape, const Weld& weld,
                                          const Scaling& plain, int axis,
                                          const std::vector<char>& is_spared) {
  const auto inputs = resize_inputs(ShapeFeatures(shape), plain, is_spared);
  if (!inputs.ok()) return inputs.status();
  client::Update update;
  update.handles.emplace(
      "resize", client::Handle{.vertices = first_copies(inputs->handle.vertices, weld),
                               .motion = client::TargetPositions{
                                   flat(std::get<TargetPositions>(inputs->handle.motion).positions)}});
  update.settings.p = field_value(inputs->material.p, weld);
  update.settings.stiffness = field_value(inputs->material.stiffness, weld);
  for (Handle& lock : side_locks(*shape, plain.axes, axis)) {
    std::erase_if(lock.vertices, [&](std::int32_t i) { return is_spared[shape->components()[i]] == 0; });
    if (lock.vertices.empty()) continue;
    const client::PlaneLock plane{.normal = array_of(std::get<PlaneLock>(lock.hold).normal)};
    update.handles.emplace(absl::StrCat("side ", update.handles.size()),
                           client::Handle{.vertices = first_copies(lock.vertices, weld), .hold = plane});
  }
  return update;
}

absl::StatusOr<client::SolveResult> solve_on(client::Client& server, const TriangleMesh& mesh,
                                             std::optional<double> welding, client::Update update,
                                             const Points& initial, Interrupt& interrupt) {
  absl::StatusOr<client::Session> session = server.open(to_client(mesh), {.weld = by_position(welding)});
  if (!session.ok()) return session.status();
  interrupt.set_action([&session] { session->close().IgnoreError(); });
  Progress progress;
  client::SolveOptions solve;
  solve.initial_positions = flat(initial);
  solve.on_progress = [&progress](const client::SolveProgress& now) { progress.show(now); };
  const auto sent = session->update(std::move(update));
  absl::StatusOr<client::SolveResult> result =
      sent.ok() ? session->solve(solve) : absl::StatusOr<client::SolveResult>(sent.status());
  interrupt.set_action({});
  return result;
}

/// One solve along one axis, blended with the mesh scaled without sparing. `shares`: the result of sparing()
/// for the mesh as it is in its file.
absl::Status stretch(client::Client& server, const Scaling& plain, std::optional<double> welding,
                     const Weld& weld, int axis, const std::vector<double>& shares, Interrupt& interrupt,
                     Resized& resized) {
  TriangleMesh& mesh = resized.file.mesh;
  const auto shape = RestShape::create(welded(mesh, weld));
  if (!shape.ok()) return shape.status();
  std::vector<char> is_spared;
  for (const double share : shares) is_spared.push_back(share > 0 ? 1 : 0);
  auto update = update_for(*shape, weld, plain, axis, is_spared);
  if (!update.ok()) return update.status();
  const auto result = solve_on(server, mesh, welding, *std::move(update), plain(mesh.vertices), interrupt);
  if (!result.ok()) return result.status();

  const Points scaled = plain((*shape)->positions());
  const Points spared = rows_of(points_of(result->positions), weld.first_copy);
  mesh.vertices =
      scattered(with_extents(**shape, plain.axes, blended(**shape, shares, scaled, spared), scaled), weld);
  resized.distortion = Eigen::Map<const Field>(result->distortion.data(),
                                               static_cast<Eigen::Index>(result->distortion.size()));
  if (resized.stop_reason == client::StopReason::kConverged) resized.stop_reason = result->stop_reason;
  std::printf("axis %d by %.6g: %s after %u iterations, %.3f s\n", axis + 1, plain.scale[axis],
              stop_reason_name(result->stop_reason).c_str(), result->iterations,
              result->setup_seconds + result->solve_seconds);
  return absl::OkStatus();
}

absl::StatusOr<Resized> resize_on(const std::string& address, const ServerAccess& access,
                                  const Scaling& scaling, std::optional<double> welding, MeshFile file,
                                  Interrupt& interrupt) {
  auto connecting = client_options(access);
  if (!connecting.ok()) return connecting.status();
  absl::StatusOr<client::Client> server = client::Client::connect(address, *std::move(connecting));
  if (!server.ok()) return server.status();
  Resized resized{std::move(file), {}};
  const double shared = shared_factor(scaling.scale);
  Scaling plain = scaling;
  plain.scale.setConstant(shared);
  const absl::StatusOr<Weld> weld = weld_of(resized.file.mesh, welding);
  if (!weld.ok()) return weld.status();
  print_notices(to_client(scattered(check_mesh(welded(resized.file.mesh, *weld)), *weld)));
  const auto rest = RestShape::create(welded(resized.file.mesh, *weld));
  if (!rest.ok()) return rest.status();
  const ShapeFeatures features(*rest);
  resized.file.mesh.vertices = scattered(plain(welded(resized.file.mesh, *weld).vertices), *weld);
  for (int axis = 0; axis < 3; ++axis) {
    const double factor = scaling.scale[axis] / shared;
    if (factor == 1) continue;
    plain.scale.setOnes();
    plain.scale[axis] = factor;
    absl::Status status =
        stretch(*server, plain, welding, *weld, axis, sparing(features, plain), interrupt, resized);
    if (!status.ok()) return status;
  }
  return resized;
}

}  // namespace

ExitStatus run_resize(const ResizeOptions& options) {
  Interrupt interrupt;
  if (absl::Status status = check_outputs(std::array{options.out}); !status.ok()) return complain(status);
  absl::StatusOr<AnyMeshFile> file = read_deformable(options.mesh);
  if (!file.ok()) return complain(file.status());
  print_left(*file);
  const std::optional<double> weld = welding(*file, options.weld, options.no_weld);
  const absl::StatusOr<PictureStyle> style = picture_style(options.picture);
  if (!style.ok()) return complain(style.status());
  const absl::StatusOr<Scaling> scaling = read_scaling(options, file->mesh);
  if (!scaling.ok()) return complain(scaling.status());

  std::unique_ptr<LocalServer> local;
  if (!options.server.address) {
    absl::StatusOr<std::unique_ptr<LocalServer>> started = LocalServer::start(options.threads);
    if (!started.ok()) return complain(started.status());
    local = *std::move(started);
  }
  const absl::StatusOr<Resized> resized = resize_on(local ? local->address() : *options.server.address,
                                                    options.server, *scaling, weld, *file, interrupt);
  if (interrupt.happened()) return kInterrupted;
  if (!resized.ok()) return complain(resized.status());
  const absl::Status written = write_output(options.out, *file, resized->file.mesh.vertices,
                                            {.distortion = resized->distortion, .weld = weld}, *style);
  if (!written.ok()) return complain(written);
  std::printf("wrote %s\n", options.out.c_str());
  return exit_status_of(resized->stop_reason, false, false);
}

}  // namespace lpdeform::cli
