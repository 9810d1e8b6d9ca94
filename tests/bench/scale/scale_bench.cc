// One line of the table by size; see run.
//
//   scale_bench make MESH.ply VERTICES                      the creature with about so many vertices
//   scale_bench solve MESH.ply P[,P...] THREADS SECONDS [ENERGY[,ENERGY...]]     a line of JSON for each p
//   scale_bench double MESH.ply THREADS     a line of JSON: what factors in double precision, with the factorisation's backend
//
// Every solve is cold, from the Laplacian deformation, and goes on to its first minimum or to the time limit. "to" are the
// seconds of solving until E^(1/p) is within 5 %, 1 % and 0.1 % of the lowest that it found, or that of ENERGY where it
// is given (0: not); null where that was not reached, or is not known because the limit came first.

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "absl/strings/str_split.h"
#include "core/io/mesh_io.h"
#include "core/linalg/cholesky.h"
#include "tests/bench/creature_pose.h"

namespace {

using namespace lpdeform;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// Seconds from a new set of handles to the first iteration.
double change(Deformer& deformer, const HandleSet& handles) {
  const Clock::time_point start = Clock::now();
  (void)deformer.set_handles(handles);
  (void)deformer.start({.method = Method::kQuasiNewton});
  return seconds_since(start);
}

void print_seconds(const char* name, double seconds) {
  if (seconds < 0)
    std::printf(", \"%s\": null", name);
  else
    std::printf(", \"%s\": %.6g", name, seconds);
}

/// `known` is the lowest energy of another run of the same solve, or 0.
void solve(const TriangleMesh& mesh, double p, int threads, double limit, double known) {
  const HandleSet handles = creature_turn(mesh);
  const Clock::time_point start = Clock::now();
  const auto shape = RestShape::create(mesh, WeightKind::kCotangent, Workers(threads)).value();
  auto deformer = Deformer::create(shape, {.threads = threads}).value();
  (void)deformer->set_handles(handles);
  (void)deformer->set_material(Material::uniform(p));
  const double before = seconds_since(start);
  SolveSettings settings;
  settings.initial = InitialGuess::kLaplacian;
  settings.time_limit_seconds = limit;
  settings.keep_trace = true;
  settings.effort = 0;
  (void)deformer->start(settings);
  std::size_t most_bytes = 0;
  while (deformer->step()) most_bytes = std::max(most_bytes, deformer->memory_bytes());
  const SolveSummary summary = deformer->summary();
  const bool is_whole = summary.stop_reason != StopReason::kTimeLimit;
  const double lowest = known > 0 ? known : summary.energy;
  const auto time_to = [&](double share) {
    if (!is_whole && known <= 0) return -1.0;
    const double enough = lowest * std::pow(share, p);
    for (const IterationRecord& record : summary.trace) {
      if (record.energy <= enough) return record.seconds;
    }
    return -1.0;
  };

  HandleSet more = handles;
  (void)more.set("patch", {creature_patch(mesh, 0.4), Fixed{}});
  HandleSet other = handles;
  (void)other.set("patch", {creature_patch(mesh, 0.6), Fixed{}});
  std::vector<double> changes{change(*deformer, more), change(*deformer, other), change(*deformer, handles)};
  std::sort(changes.begin(), changes.end());

  std::printf(
      "{\"vertices\": %d, \"p\": %g, \"threads\": %d, \"iterations\": %d, \"energy\": %.9g, \"stop\": \"%s\"",
      static_cast<int>(mesh.vertices.rows()), p, threads, static_cast<int>(summary.iterations),
      summary.energy, std::string(stop_reason_name(summary.stop_reason)).c_str());
  print_seconds("setup", before + summary.setup_seconds);
  print_seconds("iteration", summary.solve_seconds / std::max<double>(1, summary.iterations));
  print_seconds("to_5_percent", time_to(1.05));
  print_seconds("to_1_percent", time_to(1.01));
  print_seconds("to_01_percent", time_to(1.001));
  print_seconds("handle_change", changes[1]);
  std::printf(", \"bytes_per_vertex\": %.0f}\n", static_cast<double>(most_bytes + shape->memory_bytes()) /
                                                     static_cast<double>(mesh.vertices.rows()));
  std::fflush(stdout);
}

/// Seconds of: ten iterations of local_global at p = 2, the certificate at p = 2 after 100 iterations, and ten
/// iterations with up to 20 points inside faces.
void in_double_precision(const TriangleMesh& mesh, int threads) {
  const HandleSet handles = creature_turn(mesh);
  const auto shape = RestShape::create(mesh, WeightKind::kCotangent, Workers(threads)).value();
  const auto seconds_of = [&](double p, const HandleSet& held, const SolveSettings& settings,
                              bool is_certificate) {
    auto deformer = Deformer::create(shape, {.threads = threads}).value();
    (void)deformer->set_handles(held);
    (void)deformer->set_material(Material::uniform(p));
    Clock::time_point start = Clock::now();
    (void)deformer->solve(settings).value();
    if (!is_certificate) return seconds_since(start);
    start = Clock::now();
    (void)deformer->start_certificate();
    while (deformer->step()) continue;
    return seconds_since(start);
  };
  SolveSettings settings;
  settings.initial = InitialGuess::kLaplacian;
  settings.effort = 0;
  settings.max_iterations = 10;
  HandleSet points = handles;
  std::vector<char> is_held(static_cast<std::size_t>(mesh.vertices.rows()));
  for (const auto& [name, handle] : handles.handles()) {
    for (const std::int32_t v : handle.vertices) is_held[v] = true;
  }
  Handle inside;
  const std::int32_t stride = static_cast<std::int32_t>(mesh.faces.rows()) / 20;
  for (std::int32_t f = stride / 2; f < mesh.faces.rows(); f += stride) {
    const auto corners = mesh.faces.row(f);
    if (is_held[corners[0]] || is_held[corners[1]] || is_held[corners[2]]) continue;
    inside.points.push_back({f, Eigen::Vector3d::Constant(1.0 / 3)});
  }
  (void)points.set("points", inside);
  std::printf("{\"vertices\": %d, \"threads\": %d, \"backend\": \"%s\"",
              static_cast<int>(mesh.vertices.rows()), threads, cholesky_backend());
  settings.method = Method::kLocalGlobal;
  print_seconds("local_global", seconds_of(2, handles, settings, false));
  settings.method = Method::kQuasiNewton;
  print_seconds("points_in_faces", seconds_of(2, points, settings, false));
  settings.max_iterations = 100;
  print_seconds("certificate_p_2", seconds_of(2, handles, settings, true));
  std::printf("}\n");
}

}  // namespace

int main(int argc, char** argv) {
  const std::string verb = argc > 1 ? argv[1] : "";
  if (verb == "make" && argc == 4) {
    MeshFile file;
    file.mesh = creature_of(std::atof(argv[3]));
    const absl::Status status = write_mesh(argv[2], file, file.mesh.vertices, Field());
    return status.ok() ? 0 : (std::fprintf(stderr, "%s\n", std::string(status.message()).c_str()), 1);
  }
  if (verb == "double" && argc == 4) {
    const auto file = read_mesh(argv[2]);
    if (!file.ok()) return std::fprintf(stderr, "%s\n", std::string(file.status().message()).c_str()), 1;
    return in_double_precision(file->mesh, std::atoi(argv[3])), 0;
  }
  if (verb != "solve" || argc < 6 || argc > 7) {
    std::fprintf(stderr,
                 "usage: scale_bench make MESH VERTICES | double MESH THREADS | solve MESH P[,P...] THREADS "
                 "SECONDS [ENERGY[,ENERGY...]]\n");
    return 2;
  }
  const auto file = read_mesh(argv[2]);
  if (!file.ok()) return std::fprintf(stderr, "%s\n", std::string(file.status().message()).c_str()), 1;
  const std::vector<std::string> exponents = absl::StrSplit(argv[3], ',');
  std::vector<std::string> known = absl::StrSplit(argc > 6 ? argv[6] : "", ',');
  known.resize(exponents.size());
  for (std::size_t k = 0; k < exponents.size(); ++k) {
    solve(file->mesh, std::atof(exponents[k].c_str()), std::atoi(argv[4]), std::atof(argv[5]),
          std::atof(known[k].c_str()));
  }
}
