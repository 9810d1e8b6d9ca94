// lpdeform's side of the comparison with its peers.
//
//   lpdeform_peer make FOLDER                                             writes the generated tasks
//   lpdeform_peer solve MESH.off HANDLES.txt P METHOD THREADS SECONDS OUT
//
// A task is NAME.off and NAME.txt, with a line "vertex x y z" for every held vertex. `solve` writes what cgal_peer
// writes: OUT.json, the seconds of set-up and those of solving after each iteration, and OUT.f64, the positions after
// the iterations that OUT.json lists as kept.

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "core/io/mesh_io.h"
#include "core/shapes/paper_poses.h"
#include "core/shapes/shapes.h"
#include "core/solve/deformer.h"
#include "tests/bench/creature_pose.h"

namespace {

using namespace lpdeform;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

PaperPose creature_pose(const std::string& name, double vertices) {
  TriangleMesh mesh = creature_of(vertices);
  HandleSet handles = creature_turn(mesh);
  return {name, std::move(mesh), std::move(handles), ""};
}

/// 40,401 vertices: the middle is lifted, the rim stays.
PaperPose bumpy_plane() {
  PaperPose pose{"bumpy_plane", grid(200, 200, 4), {}, ""};
  std::vector<std::int32_t> rim, middle;
  for (std::int32_t v = 0; v < pose.mesh.vertices.rows(); ++v) {
    const double x = pose.mesh.vertices(v, 0) - 100, y = pose.mesh.vertices(v, 1) - 100;
    if (std::max(std::abs(x), std::abs(y)) > 92) rim.push_back(v);
    if (std::hypot(x, y) < 20) middle.push_back(v);
  }
  (void)pose.handles.set("rim", {rim, Fixed{}});
  (void)pose.handles.set("middle", {middle, RigidMotion{.translation = {0, 0, 60}}});
  return pose;
}

int write_task(const PaperPose& pose, const std::filesystem::path& folder) {
  std::ofstream mesh(folder / (pose.name + ".off")), handles(folder / (pose.name + ".txt"));
  mesh.precision(17);
  handles.precision(17);
  mesh << "OFF\n" << pose.mesh.vertices.rows() << ' ' << pose.mesh.faces.rows() << " 0\n";
  for (const auto& row : pose.mesh.vertices.rowwise()) mesh << row << '\n';
  for (const auto& row : pose.mesh.faces.rowwise()) mesh << "3 " << row << '\n';
  for (const auto& [name, handle] : pose.handles.handles()) {
    const Points targets = target_positions(handle, pose.mesh.vertices);
    for (std::size_t k = 0; k < handle.vertices.size(); ++k) {
      handles << handle.vertices[k] << ' ' << targets.row(static_cast<Eigen::Index>(k)) << '\n';
    }
  }
  return mesh.good() && handles.good() ? 0 : 1;
}

int make(const std::filesystem::path& folder) {
  int failures = 0;
  for (const PaperPose& pose : {paper_bar(1), paper_sheet(1), paper_block(1), bumpy_plane(),
                                creature_pose("creature_10k", 1e4), creature_pose("creature_100k", 1e5)}) {
    failures += write_task(pose, folder);
  }
  return failures;
}

HandleSet read_handles(const std::string& path) {
  std::ifstream in(path);
  Handle held;
  std::vector<double> numbers;
  std::int32_t vertex;
  double x, y, z;
  while (in >> vertex >> x >> y >> z) {
    held.vertices.push_back(vertex);
    numbers.insert(numbers.end(), {x, y, z});
  }
  held.motion = TargetPositions{
      Eigen::Map<const Points>(numbers.data(), static_cast<Eigen::Index>(held.vertices.size()), 3)};
  HandleSet handles;
  (void)handles.set("held", std::move(held));
  return handles;
}

void write_numbers(std::FILE* file, const char* name, const std::vector<double>& numbers) {
  std::fprintf(file, "\"%s\": [", name);
  for (std::size_t k = 0; k < numbers.size(); ++k) std::fprintf(file, "%s%.9g", k ? ", " : "", numbers[k]);
  std::fprintf(file, "]");
}

int solve(char** argv) {
  const auto mesh = read_mesh(argv[0]);
  if (!mesh.ok()) return std::fprintf(stderr, "%s\n", std::string(mesh.status().message()).c_str()), 1;
  const HandleSet handles = read_handles(argv[1]);
  const double p = std::atof(argv[2]), limit = std::atof(argv[5]);
  const std::string out = argv[6];
  SolveSettings settings;
  settings.method = method_named(argv[3]).value_or(Method::kAuto);
  settings.initial = InitialGuess::kLaplacian;

  Clock::time_point start = Clock::now();
  auto deformer =
      Deformer::create(RestShape::create(mesh->mesh).value(), {.threads = std::atoi(argv[4])}).value();
  (void)deformer->set_handles(handles);
  (void)deformer->set_material(Material::uniform(p));
  double setup = seconds_since(start);
  start = Clock::now();
  (void)deformer->start(settings);
  double total = seconds_since(start) - deformer->summary().setup_seconds;
  setup += deformer->summary().setup_seconds;

  std::FILE* const positions = std::fopen((out + ".f64").c_str(), "wb");
  std::vector<double> seconds, kept;
  const auto keep = [&] {
    kept.push_back(static_cast<double>(seconds.size()));
    const Points& x = deformer->positions();
    std::fwrite(x.data(), sizeof(double), static_cast<std::size_t>(x.size()), positions);
  };
  for (bool is_running = true; is_running && total < limit;) {
    seconds.push_back(total);
    if (kept.empty() || static_cast<double>(seconds.size()) >= 1.05 * kept.back()) keep();
    start = Clock::now();
    is_running = deformer->step();
    total += seconds_since(start);
  }
  seconds.push_back(total);
  keep();  // the last in any case
  std::fclose(positions);
  std::FILE* const json = std::fopen((out + ".json").c_str(), "w");
  std::fprintf(json, "{\"setup\": %.9g, ", setup);
  write_numbers(json, "seconds", seconds);
  std::fprintf(json, ", ");
  write_numbers(json, "kept", kept);
  std::fprintf(json, "}\n");
  return std::fclose(json);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 3 && std::string(argv[1]) == "make") return make(argv[2]);
  if (argc == 9 && std::string(argv[1]) == "solve") return solve(argv + 2);
  return std::fprintf(stderr,
                      "usage: lpdeform_peer make FOLDER\n"
                      "       lpdeform_peer solve MESH.off HANDLES.txt P METHOD THREADS SECONDS OUT\n"),
         2;
}
