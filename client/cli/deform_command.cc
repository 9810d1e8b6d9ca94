#include "client/cli/deform_command.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/files/handle_file.h"
#include "client/cli/files/mesh_input.h"
#include "client/cli/files/outputs.h"
#include "client/cli/files/text_file.h"
#include "client/cli/interrupt.h"
#include "client/cli/local_server.h"
#include "client/cli/progress.h"
#include "client/cli/report.h"
#include "client/cli/search_text.h"
#include "client/cpp/client.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"

namespace lpdeform::cli {
namespace {

/// All inputs of the command, read and checked before any work is done.
struct Inputs {
  AnyMeshFile file;
  std::optional<double> weld;
  client::Update update;
  client::FieldValue p;
  std::optional<std::vector<double>> initial_positions;
  PictureStyle style;
};

absl::Status read_initial(const DeformOptions& options, Inputs& inputs) {
  if (options.initial == "laplacian" || options.initial == "rest") return absl::OkStatus();
  const absl::StatusOr<AnyMeshFile> initial = read_mesh_file(options.initial);
  if (!initial.ok()) return initial.status();
  const Eigen::Index given = initial->mesh.vertices.rows(), wanted = inputs.file.mesh.vertices.rows();
  if (given != wanted) {
    return make_fault({Reason::kPositionsSize, options.initial, absl::StrCat("vertices = ", wanted)},
                      absl::StrCat("\"", options.initial, "\" has ", given, " vertices and the mesh ", wanted,
                                   "; an initial guess has as many as the mesh."));
  }
  inputs.initial_positions = flat(initial->mesh.vertices);
  return absl::OkStatus();
}

client::SolverSettings solver_settings(const DeformOptions& options) {
  client::SolverSettings result{
      .method = options.method,
      .tolerance = options.tolerance,
      .max_iterations = options.max_iterations.value_or(0),
      .time_limit_seconds = options.time_limit_seconds.value_or(0),
      .initial = options.initial == "rest" ? client::InitialGuess::kRest : client::InitialGuess::kLaplacian};
  if (options.effort) result.search = client::MinimaSearch{.effort = *options.effort};
  return result;
}

/// The result may overwrite the mesh. No output may overwrite another input or another output.
absl::Status check_files_apart(const DeformOptions& options) {
  std::vector<NamedFile> written, read{{"--handles", options.handles}};
  for (const auto& [option, file] : {std::pair("--p-field", options.material.p_field),
                                     std::pair("--stiffness-field", options.material.stiffness_field)}) {
    if (file) read.push_back({option, *file});
  }
  for (const std::filesystem::path& path : options.out) written.push_back({"--out", path});
  if (options.report) written.push_back({"--report", *options.report});
  if (absl::Status status = check_apart(written, read); !status.ok()) return status;
  if (!options.report) return absl::OkStatus();
  return check_apart(std::array{NamedFile{"--report", *options.report}},
                     std::array{NamedFile{"MESH", options.mesh}});
}

absl::StatusOr<Inputs> read_inputs(const DeformOptions& options) {
  absl::Status status = check_outputs(options.out);
  if (status.ok()) status = check_files_apart(options);
  if (status.ok() && options.normals) status = check_normals_have_output(options.out);
  if (status.ok() && options.report) status = check_folder(*options.report);
  if (!status.ok()) return status;
  absl::StatusOr<AnyMeshFile> file = read_deformable(options.mesh);
  if (!file.ok()) return file.status();
  print_left(*file);
  const std::optional<double> weld = welding(*file, options.weld, options.no_weld);
  auto style = picture_style(options.picture);
  if (!style.ok()) return style.status();
  Inputs inputs{*std::move(file), weld, {}, {}, {}, *std::move(style)};
  const std::int64_t vertex_count = inputs.file.mesh.vertices.rows();

  absl::StatusOr<HandleFile> held = read_handles(options.handles, vertex_count);
  if (!held.ok()) return held.status();
  if (!held->region.empty())
    inputs.update.settings.region = client::RegionOfInterest{std::move(held->region)};
  for (NamedHandle& handle : held->handles)
    inputs.update.handles.emplace(std::move(handle.name), std::move(handle.handle));
  status =
      read_material(options.material, inputs.file, std::move(held->groups), weld, inputs.update.settings);
  if (!status.ok()) return status;
  inputs.p = *inputs.update.settings.p;
  status = read_initial(options, inputs);
  if (!status.ok()) return status;
  inputs.update.settings.length_unit = options.length_unit;
  inputs.update.settings.solver = solver_settings(options);
  return inputs;
}

struct Solved {
  client::MeshReport mesh;
  client::SolveResult result;
};

absl::StatusOr<Solved> solve_on(const std::string& address, const DeformOptions& options, Inputs& inputs,
                                Interrupt& interrupt) {
  Progress progress;
  progress.show("connecting");
  auto connecting = client_options(options.server);
  if (!connecting.ok()) return connecting.status();
  absl::StatusOr<client::Client> server = client::Client::connect(address, *std::move(connecting));
  if (!server.ok()) return server.status();
  progress.show("sending the mesh");
  absl::StatusOr<client::Session> session =
      server->open(to_client(inputs.file.mesh), {.weights = options.weights,
                                                 .free_components = options.free_components,
                                                 .weld = by_position(inputs.weld)});
  if (!session.ok()) return session.status();
  progress.clear();
  print_notices(session->mesh_report());
  interrupt.set_action([&session] { session->close().IgnoreError(); });

  client::SolveOptions solve{.certify = options.certify || options.report.has_value(),
                             .keep_trace = options.report.has_value()};
  solve.with_normals = options.normals;
  solve.initial_positions = std::move(inputs.initial_positions);
  solve.on_progress = [&progress](const client::SolveProgress& now) { progress.show(now); };
  absl::StatusOr<client::SolveResult> result = absl::CancelledError();
  if (const auto sent = session->update(std::move(inputs.update)); sent.ok()) result = session->solve(solve);
  interrupt.set_action({});
  if (!result.ok()) return result.status();
  return Solved{session->mesh_report(), *std::move(result)};
}

absl::Status write_results(const DeformOptions& options, const Inputs& inputs, const Solved& solved) {
  const Points positions = points_of(solved.result.positions);
  const auto& distortion = solved.result.distortion;
  const Field field =
      Eigen::Map<const Field>(distortion.data(), static_cast<Eigen::Index>(distortion.size()));
  const Beside beside{.distortion = field,
                      .normals = points_of(solved.result.normals),
                      .adds_normals = options.normals,
                      .weld = inputs.weld};
  for (const std::filesystem::path& path : options.out) {
    absl::Status written = write_output(path, inputs.file, positions, beside, inputs.style);
    if (!written.ok()) return written;
    std::printf("wrote %s\n", path.c_str());
  }
  if (!options.report) return absl::OkStatus();
  absl::Status written = write_text(*options.report, report_json(solved.mesh, inputs.p, solved.result));
  if (written.ok()) std::printf("wrote %s\n", options.report->c_str());
  return written;
}

void print_summary(const Inputs& inputs, const Solved& solved) {
  const client::SolveResult& result = solved.result;
  std::printf("%s after %u iterations of %s, %.3f s: E = %.6g, from %.6g",
              stop_reason_name(result.stop_reason).c_str(), result.iterations - result.search_iterations,
              result.method.c_str(), result.setup_seconds + result.solve_seconds, result.energy,
              result.initial_energy);
  if (const double* const p = std::get_if<double>(&inputs.p))
    std::printf("; E^(1/p) = %.6g", std::pow(result.energy, 1 / *p));
  if (result.optimality_gap) std::printf("; gap %.2g", *result.optimality_gap);
  std::printf("\n");
  if (result.optimality_gap || result.effort > 0) std::printf("%s\n", search_text(result).c_str());
}

}  // namespace

ExitStatus run_deform(const DeformOptions& options) {
  Interrupt interrupt;
  absl::StatusOr<Inputs> inputs = read_inputs(options);
  if (!inputs.ok()) return complain(inputs.status());

  std::unique_ptr<LocalServer> local;
  if (!options.server.address) {
    absl::StatusOr<std::unique_ptr<LocalServer>> started = LocalServer::start(options.threads);
    if (!started.ok()) return complain(started.status());
    local = *std::move(started);
  }
  const absl::StatusOr<Solved> solved =
      solve_on(local ? local->address() : *options.server.address, options, *inputs, interrupt);
  if (interrupt.happened()) return kInterrupted;
  if (!solved.ok()) return complain(solved.status());

  print_summary(*inputs, *solved);
  const absl::Status written = write_results(options, *inputs, *solved);
  if (!written.ok()) return complain(written);
  return exit_status_of(solved->result.stop_reason, options.max_iterations.has_value(),
                        options.time_limit_seconds.has_value());
}

}  // namespace lpdeform::cli
