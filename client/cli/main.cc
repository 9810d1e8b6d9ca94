// The command line of the program `lpdeform`.

#include <CLI/CLI.hpp>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "client/cli/deform_command.h"
#include "client/cli/generated_shape.h"
#include "client/cli/info_command.h"
#include "client/cli/load_command.h"
#include "client/cli/reproduce_command.h"
#include "client/cli/resize_command.h"
#include "client/cli/server_access.h"
#include "client/cli/shape_command.h"
#include "client/cli/snapshot_command.h"
#include "core/base/fault.h"
#include "core/base/reasons.h"
#include "core/shapes/paper_poses.h"

namespace lpdeform::cli {
namespace {

template <typename T>
using Choices = std::vector<std::pair<std::string, T>>;

/// An option that takes one of several names and stores the value that the name stands for.
template <typename T>
void add_choice(CLI::App& app, const std::string& flag, T& target, const Choices<T>& choices,
                const std::string& help) {
  std::vector<std::string> names;
  for (const auto& [name, value] : choices) names.push_back(name);
  const auto store = [&target, choices](const std::string& given) {
    for (const auto& [name, value] : choices) {
      if (name == given) target = value;
    }
  };
  app.add_option_function<std::string>(flag, store, help)
      ->check(CLI::IsMember(names))
      ->option_text(absl::StrJoin(names, "|"));
}

/// A number within [lowest, highest], with a readable message.
CLI::Validator within(double lowest, double highest) {
  const std::string range = absl::StrCat(lowest, " to ", highest);
  return CLI::Validator(
      [=](std::string& text) {
        double value = 0;
        const bool is_number = CLI::detail::lexical_cast(text, value);
        if (is_number && value >= lowest && value <= highest) return std::string();
        return absl::StrCat(text, " is not a number from ", range);
      },
      range);
}

/// A finite number above 0.
CLI::Validator positive() {
  return CLI::Validator(
      [](std::string& text) {
        double value = 0;
        const bool is_number = CLI::detail::lexical_cast(text, value);
        if (is_number && value > 0 && std::isfinite(value)) return std::string();
        return absl::StrCat(text, " is not a number above 0");
      },
      "> 0");
}

/// Accepts what parse_p accepts.
CLI::Validator norm() {
  return CLI::Validator(
      [](std::string& text) {
        MaterialOptions ignored;
        if (parse_p(text, ignored)) return std::string();
        return absl::StrCat(text,
                            " is not a number from 1 to 64, nor auto, nor auto: and a number from 0 to 1");
      },
      "P");
}

void add_material_options(CLI::App& app, DeformOptions& options) {
  MaterialOptions& material = options.material;
  CLI::Option* const p =
      app.add_option_function<std::string>(
             "--p", [&material](const std::string& text) { parse_p(text, material); },
             "The norm p, 1 to 64: a small p concentrates distortion, a large p spreads it (2). auto finds "
             "p and stiffness from the geometry: joints are soft and parts rigid, with a strength of 0 to 1 "
             "(auto is auto:1)")
          ->check(norm())
          ->option_text("P|auto[:STRENGTH]");
  app.add_option("--p-field", material.p_field, "A p for each vertex: a file with one number per line")
      ->excludes(p)
      ->option_text("FILE");
  app.add_option("--stiffness-field", material.stiffness_field,
                 "A stiffness for each vertex, 1e-6 to 1e6: a file with one number per line (1 everywhere)")
      ->option_text("FILE");
  app.add_option("--p-group", material.p_groups,
                 "A p for the vertices of a group of the handle file or of an OBJ or glTF mesh; may be given "
                 "several times")
      ->allow_extra_args(false)
      ->option_text("NAME=P");
  app.add_option("--stiffness-group", material.stiffness_groups,
                 "A stiffness for the vertices of a group; may be given several times")
      ->allow_extra_args(false)
      ->option_text("NAME=S");
  app.add_option(
         "--length-unit", options.length_unit,
         "The unit of length for energies with different p, in the mesh's unit (the mean edge length)")
      ->check(positive())
      ->option_text("L");
  add_choice<client::WeightKind>(
      app, "--weights", options.weights,
      {{"cotangent", client::WeightKind::kCotangent},
       {"uniform", client::WeightKind::kUniform},
       {"intrinsic_delaunay", client::WeightKind::kIntrinsicDelaunay}},
      "Weights of the edges; intrinsic_delaunay needs no clamping for thin triangles (cotangent)");
  add_choice<client::FreeComponents>(
      app, "--free-components", options.free_components,
      {{"error", client::FreeComponents::kError},
       {"stay", client::FreeComponents::kStay},
       {"follow", client::FreeComponents::kFollow}},
      "What happens to a part of the mesh that no handle holds: it is an error, it stays in place, or it "
      "follows the nearest handle (error)");
}

void add_solver_options(CLI::App& app, DeformOptions& options) {
  add_choice<client::Method>(
      app, "--method", options.method,
      {{"auto", client::Method::kAuto},
       {"quasi_newton", client::Method::kQuasiNewton},
       {"multiresolution", client::Method::kMultiresolution},
       {"line_search", client::Method::kLineSearch},
       {"local_global", client::Method::kLocalGlobal},
       {"conic", client::Method::kConic}},
      "The algorithm. local_global needs p = 2. conic needs p = 1 and stops like the paper, some percent "
      "above the minimum. auto takes quasi_newton, or multiresolution on large meshes (auto)");
  app.add_option("--initial", options.initial,
                 "The initial guess; a mesh must have as many vertices as MESH (laplacian)")
      ->option_text("laplacian|rest|MESH");
  app.add_option("--max-iterations", options.max_iterations, "Stop after this many iterations")
      ->check(positive())
      ->option_text("N");
  app.add_option("--tolerance", options.tolerance,
                 "Stop when the relative gain still possible is below this, 1e-14 to 0.1 (1e-5)")
      ->check(within(1e-14, 0.1))
      ->option_text("T");
  app.add_option(
         "--effort", options.effort,
         "How far to look for lower minima, 0 to 1000: 12 times N further starts. 0 takes the first "
         "minimum. Without this option: 1 with method auto where some p is below 2, unless --initial is "
         "a mesh; otherwise 0")
      ->check(within(0, 1000))
      ->option_text("N");
  app.add_option("--time-limit", options.time_limit_seconds, "Stop after this many seconds of solving")
      ->check(positive())
      ->option_text("SECONDS");
}

void add_picture_options(CLI::App& app, PictureOptions& picture) {
  app.add_option("--size", picture.size,
                 "Width and height of a picture in pixels, each 1 to 16384 (1200,900)")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::Range(1, 16384))
      ->option_text("W,H");
  app.add_option(
         "--camera", picture.camera,
         "A mesh for the camera: pictures are framed as if they showed this mesh, so that several can be "
         "compared (each picture's own mesh)")
      ->option_text("MESH");
  app.add_option("--red", picture.red,
                 "The distortion that pictures show in full red (each picture's own largest)")
      ->check(positive())
      ->option_text("E");
}

void add_weld(CLI::App& app, std::optional<double>& weld, bool& no_weld) {
  CLI::Option* const option =
      app.add_option("--weld", weld,
                     "Weld vertices in the same place, for meshes split along seams of texture or normals. "
                     "TOLERANCE is "
                     "their largest distance as a share of the bounding box's diagonal, 0 to 0.001 (1e-6)")
          ->check(within(0, 1e-3))
          ->option_text("[TOLERANCE]");
  app.add_flag("--no-weld", no_weld,
               "Keep vertices in the same place apart also in glTF, which is welded otherwise")
      ->excludes(option);
}

/// A number after --weld is its tolerance. Without a number the tolerance is the default, and the next
/// argument does not belong to --weld. Only for the commands that weld.
std::vector<std::string> with_weld_told(int argc, char** argv) {
  std::vector<std::string> told;
  const std::string command = argc > 1 ? argv[1] : "";
  for (int k = 0; k < argc; ++k) {
    double number = 0;
    const bool is_weld = (command == "deform" || command == "resize") && argv[k] == std::string("--weld");
    const bool has_number = is_weld && k + 1 < argc && CLI::detail::lexical_cast(argv[k + 1], number);
    told.emplace_back(argv[k]);
    if (is_weld) told.back() += has_number ? absl::StrCat("=", argv[++k]) : "=0";
  }
  return told;
}

void add_access_options(CLI::App& app, ServerAccess& access, CLI::Option* server) {
  app.add_flag("--tls", access.tls, "Connect with TLS and trust the system's certificates")->needs(server);
  app.add_option("--tls-ca", access.tls_ca, "Connect with TLS and trust these certificates, in PEM")
      ->needs(server)
      ->option_text("FILE");
  CLI::Option* const cert = app.add_option("--tls-cert", access.tls_cert,
                                           "The client's certificate, in PEM, if the server asks for one")
                                ->needs(server)
                                ->option_text("FILE");
  CLI::Option* const key =
      app.add_option("--tls-key", access.tls_key, "The client certificate's private key, in PEM")
          ->needs(cert)
          ->option_text("FILE");
  cert->needs(key);
  app.add_option("--token-file", access.token_file,
                 "A file with the bearer token, if the server asks for one")
      ->envname("LPDEFORM_TOKEN_FILE")
      ->option_text("FILE");
}

void add_server_options(CLI::App& app, ServerAccess& access, CLI::Option* excluded) {
  CLI::Option* const server =
      app.add_option("--server", access.address,
                     "HOST:PORT or unix:PATH of a server (none: solves in this process)")
          ->excludes(excluded)
          ->option_text("ADDRESS");
  add_access_options(app, access, server);
}

/// Adds the options of commands that need a server.
void add_needed_server(CLI::App& app, ServerAccess& access) {
  CLI::Option* const server =
      app.add_option("--server", access.address, "HOST:PORT or unix:PATH of the server")
          ->required()
          ->option_text("ADDRESS");
  add_access_options(app, access, server);
}

void add_deform(CLI::App& program, std::function<ExitStatus()>& command) {
  CLI::App& app = *program.add_subcommand("deform", "Deform a mesh by its handles and write the result");
  const auto options = std::make_shared<DeformOptions>();
  app.add_option("MESH", options->mesh, "GLB, glTF, OFF, OBJ, PLY or STL")->required()->option_text(" ");
  app.add_option("--handles", options->handles,
                 "The handle file: which vertices are held and where they move; JSON, see below; required")
      ->required()
      ->option_text("FILE");
  add_material_options(app, *options);
  add_solver_options(app, *options);
  app.add_option(
         "--out", options->out,
         "Where to write the result; may be given several times. The ending decides: .ply with distortion "
         "and colours, .glb, .gltf, .obj, .off, or a picture as .png")
      ->allow_extra_args(false)
      ->option_text("FILE");
  add_picture_options(app, options->picture);
  add_weld(app, options->weld, options->no_weld);
  app.add_flag(
      "--normals", options->normals,
      "Write normals to .glb, .gltf, .obj and .ply, one of which must be among the outputs. Normals of a "
      "glTF or OBJ input are turned with the surface, so its hard edges stay hard");
  app.add_flag(
      "--certify", options->certify,
      "Print a bound on how far the result is from the best one for its rotations (also in a report)");
  app.add_option("--report", options->report, "Where to write a report of the solve, as JSON")
      ->option_text("FILE");
  CLI::Option* const threads =
      app.add_option("--threads", options->threads, "The number of cores to use at most (all)")
          ->check(CLI::Range(1, 1024))
          ->option_text("N");
  add_server_options(app, options->server, threads);
  app.callback([&command, options] { command = [options] { return run_deform(*options); }; });
  app.footer(
      "Defaults are in brackets.\n\n"
      "A handle holds vertices in place, or moves them: it rotates them first, then translates them.\n"
      "  {\"handles\": [{\"name\": \"base\", \"vertices\": [0, 1, 2]},\n"
      "               {\"name\": \"tip\", \"vertices\": [7, 8], \"translate\": [0, 0, 1],\n"
      "                \"rotate\": {\"axis\": [0, 0, 1], \"angle_degrees\": 30, \"center\": [0, 0, 0]}},\n"
      "               {\"name\": \"free\", \"vertices\": [9], \"positions\": [[1, 2, 3]]}]}\n\n"
      "Exit status: 0 converged, or ended by a limit that was set here; 1 broke down or stalled short of\n"
      "the tolerance; 2 bad input; 3 server unreachable or refusing.");
}

void add_info(CLI::App& program, std::function<ExitStatus()>& command) {
  CLI::App& app = *program.add_subcommand("info", "Print what a mesh consists of and its defects");
  const auto options = std::make_shared<InfoOptions>();
  app.add_option("MESH", options->mesh, "GLB, glTF, OFF, OBJ, PLY or STL")->required()->option_text(" ");
  app.add_flag("--json", options->is_json, "Print the object \"mesh\" of a report");
  app.callback([&command, options] { command = [options] { return run_info(*options); }; });
}

/// Three numbers separated by commas.
CLI::Option* add_vector(CLI::App& app, const std::string& flag, std::vector<double>& target,
                        const std::string& help) {
  return app.add_option(flag, target, help)->delimiter(',')->expected(3)->option_text("X,Y,Z");
}

void add_resize(CLI::App& program, std::function<ExitStatus()>& command) {
  CLI::App& app = *program.add_subcommand(
      "resize", "Scale a mesh by different factors along its axes; salient parts keep their shape");
  const auto options = std::make_shared<ResizeOptions>();
  app.add_option("MESH", options->mesh, "GLB, glTF, OFF, OBJ, PLY or STL")->required()->option_text(" ");
  app.add_option("OUT", options->out,
                 "Where to write the result: .ply, .glb, .gltf, .obj, .off, or a picture as .png")
      ->required()
      ->option_text(" ");
  add_vector(app, "--scale", options->scale, "Factors along the three axes, each 0.01 to 100; required")
      ->check(within(0.01, 100))
      ->required();
  add_vector(app, "--origin", options->origin,
             "The point that stays in place (the middle of the bounding box)");
  add_vector(app, "--x-axis", options->x_axis, "The direction of the first factor (1,0,0)");
  add_vector(app, "--y-axis", options->y_axis, "The direction of the second factor (0,1,0)");
  add_picture_options(app, options->picture);
  add_weld(app, options->weld, options->no_weld);
  CLI::Option* const threads =
      app.add_option("--threads", options->threads, "The number of cores to use at most (all)")
          ->check(CLI::Range(1, 1024))
          ->option_text("N");
  add_server_options(app, options->server, threads);
  app.callback([&command, options] { command = [options] { return run_resize(*options); }; });
}

void add_load(CLI::App& program, std::function<ExitStatus()>& command) {
  CLI::App& app = *program.add_subcommand(
      "load",
      "Load a server: send updates at fixed times and measure the time to the frames that answer them");
  const auto options = std::make_shared<LoadOptions>();
  add_needed_server(app, options->server);
  app.add_option("--sessions", options->sessions, "Number of sessions (10)")
      ->check(CLI::Range(1, 10000))
      ->option_text("N");
  app.add_option(
         "--vertices", options->vertices,
         "Vertices of each session's mesh; several sizes, separated by commas, are used in turn (1000)")
      ->delimiter(',')
      ->check(CLI::Range(4, 2000000))
      ->option_text("V[,V]...");
  app.add_option("--rate", options->rate, "Updates per second of each session (10)")
      ->check(within(0.01, 1000))
      ->option_text("R");
  app.add_option("--seconds", options->seconds, "Duration in seconds (10)")
      ->check(within(0.1, 1e6))
      ->option_text("T");
  app.add_option("--p", options->p, "p of each session, 1 to 64 (2)")->check(within(1, 64))->option_text("P");
  app.add_option("--slow-readers", options->slow_readers,
                 "Number of sessions that have a second, slow reader (0)")
      ->check(CLI::Range(0, 10000))
      ->option_text("N");
  app.add_option("--slow-pause", options->slow_pause_seconds,
                 "Seconds between two frames of a slow reader (1)")
      ->check(within(0.001, 3600))
      ->option_text("S");
  app.add_option("--reconnect", options->reconnect_seconds, "Each session reconnects every S seconds (never)")
      ->check(within(0.1, 1e6))
      ->option_text("S");
  app.add_option("--report", options->report, "Where to write the measurements, as JSON")
      ->option_text("FILE");
  app.callback([&command, options] { command = [options] { return run_load(*options); }; });
  app.footer(
      "Input to frame: from when an update was due until the first frame that answers it arrived. Updates\n"
      "are due at fixed times, so it shows if a server falls behind. Exit status: 0 every update was\n"
      "answered and nothing failed; 1 otherwise; 2 bad input; 3 server unreachable or refusing.");
}

void add_shape(CLI::App& program, std::function<ExitStatus()>& command) {
  CLI::App& app =
      *program.add_subcommand("shape", "Write a generated mesh for experiments, and handles for it");
  const auto options = std::make_shared<ShapeOptions>();
  const std::vector<std::string> names = generated_shape_names();
  app.add_option("NAME", options->name, absl::StrJoin(names, ", "))
      ->required()
      ->check(CLI::IsMember(names))
      ->option_text(" ");
  CLI::Option* const detail =
      app.add_option("--detail", options->detail, "Multiplies the cells along each side (1)")
          ->option_text("N");
  app.add_option("--vertices", options->vertices, "About how many vertices it has, at most 5 million")
      ->check(positive())
      ->option_text("N")
      ->excludes(detail);
  app.add_option("--out", options->out,
                 "Where to write the mesh: .off, .obj, .ply, or a picture as .png; required")
      ->required()
      ->option_text("FILE");
  app.add_option("--handles", options->handles, "Where to write a handle file for the mesh")
      ->option_text("FILE");
  app.callback([&command, options] { command = [options] { return run_shape(*options); }; });
}

void add_snapshot(CLI::App& program, std::function<ExitStatus()>& command) {
  CLI::App& app = *program.add_subcommand("snapshot", "Write a session of a server to a file");
  const auto options = std::make_shared<SnapshotOptions>();
  app.add_option("SESSION", options->session, "Its name: sessions/ and 32 digits")
      ->required()
      ->option_text(" ");
  app.add_option("FILE", options->file, "The file to write")->required()->option_text(" ");
  add_needed_server(app, options->server);
  app.callback([&command, options] { command = [options] { return run_snapshot(*options); }; });
}

void add_restore(CLI::App& program, std::function<ExitStatus()>& command) {
  CLI::App& app = *program.add_subcommand(
      "restore", "Make a session on a server from the file of a snapshot and print its name");
  const auto options = std::make_shared<RestoreOptions>();
  app.add_option("FILE", options->file, "A file that snapshot wrote")->required()->option_text(" ");
  add_needed_server(app, options->server);
  app.callback([&command, options] { command = [options] { return run_restore(*options); }; });
}

void add_reproduce(CLI::App& program, std::function<ExitStatus()>& command) {
  CLI::App& app = *program.add_subcommand(
      "reproduce", "Reproduce the paper's table and figures as a page with a verdict on each claim");
  const auto options = std::make_shared<ReproduceOptions>();
  app.add_option("--out", options->out, "The folder for index.html, pictures and reproduce.json; required")
      ->required()
      ->option_text("DIR");
  app.add_option("--size", options->size, "Multiplies the cells along each side of the shapes, 0.25 to 4 (1)")
      ->check(within(kSmallestPoseSize, 4))
      ->option_text("FACTOR");
  app.add_option("--mesh", options->meshes, "Another mesh to solve for each p; may be given several times")
      ->allow_extra_args(false)
      ->option_text("FILE");
  app.add_option("--handles", options->handles, "The handle file for each --mesh, in the same order")
      ->allow_extra_args(false)
      ->option_text("FILE");
  app.add_option("--threads", options->threads, "The number of cores to use at most (all)")
      ->check(CLI::Range(1, 1024))
      ->option_text("N");
  app.add_flag("--force", options->is_forced, "Write also into a folder that holds other files");
  app.callback([&command, options] { command = [options] { return run_reproduce(*options); }; });
}

int run(int argc, char** argv) {
  CLI::App program("Deforms surfaces by handles, with distortion measured in an L_p norm of your choice.",
                   "lpdeform");
  program.set_version_flag("--version", "lpdeform " LPDEFORM_VERSION);
  program.require_subcommand(1);
  program.get_formatter()->column_width(34);
  std::function<ExitStatus()> command;
  add_deform(program, command);
  add_info(program, command);
  add_resize(program, command);
  add_load(program, command);
  add_shape(program, command);
  add_snapshot(program, command);
  add_restore(program, command);
  add_reproduce(program, command);
  try {
    const std::vector<std::string> arguments = with_weld_told(argc, argv);
    std::vector<const char*> words;
    for (const std::string& argument : arguments) words.push_back(argument.c_str());
    program.parse(static_cast<int>(words.size()), words.data());
  } catch (const CLI::Success& asked_for_help) {
    return program.exit(asked_for_help);
  } catch (const CLI::ParseError& error) {
    if (const auto unknown = program.remaining(); program.get_subcommands().empty() && !unknown.empty()) {
      return complain(absl::InvalidArgumentError("There is no command \"" + unknown.front() +
                                                 "\" (see lpdeform --help)"));
    }
    const auto chosen = program.get_subcommands();
    const std::string help =
        chosen.empty() ? "lpdeform --help" : "lpdeform " + chosen.front()->get_name() + " --help";
    return complain(absl::InvalidArgumentError(absl::StrCat(error.what(), " (see ", help, ")")));
  }
  return command();
}

/// Reports output that could not be written, as on a full disk, so that a script notices.
int with_output_checked(int status) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return status;
  const std::string why = std::strerror(errno);
  return complain(make_fault(absl::StatusCode::kDataLoss, {Reason::kFileNotWritten, "standard output", ""},
                             absl::StrCat("What was printed could not be written: ", why, ".")));
}

}  // namespace
}  // namespace lpdeform::cli

int main(int argc, char** argv) {
  // Writing beyond a limit on file size then fails, instead of ending the process.
  std::signal(SIGXFSZ, SIG_IGN);
  return lpdeform::cli::with_output_checked(lpdeform::cli::run(argc, argv));
}
