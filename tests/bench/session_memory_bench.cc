// Memory of a session per vertex: what the core counts (which admission uses), and how much the peak of the process grows while
// a session is made and solves. Linux only: /proc/self/clear_refs resets the peak.

#include <benchmark/benchmark.h>

#include <fstream>
#include <string>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

double status_bytes(const std::string& field) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with(field)) return 1024 * std::stod(line.substr(field.size() + 1));
  }
  return 0;
}

void session_memory(benchmark::State& state) {
  const auto side = static_cast<int>(state.range(0));
  double counted = 0, peak = 0, vertices = 1;
  for (auto _ : state) {
    const TriangleMesh mesh = grid(side, side, 2);
    HandleSet handles;
    (void)handles.set("left", {slice(mesh, 0, 0, 0), Fixed{}});
    (void)handles.set("right", {slice(mesh, 0, side, side), RigidMotion{.translation = {0, 0, 0.3 * side}}});
    vertices = static_cast<double>(mesh.vertices.rows());

    const double before = status_bytes("VmRSS:");
    std::ofstream("/proc/self/clear_refs") << "5";
    auto solver = deformer(rest_shape(mesh), handles, Material::uniform(1.5));
    SolveSettings settings;
    settings.initial = InitialGuess::kLaplacian;
    settings.max_iterations = 15;
    benchmark::DoNotOptimize(solver->solve(settings).value().energy);
    peak = status_bytes("VmHWM:") - before;
    counted = static_cast<double>(solver->memory_bytes() + solver->shape().memory_bytes());
  }
  state.counters["vertices"] = vertices;
  state.counters["counted_bytes_a_vertex"] = counted / vertices;
  state.counters["peak_bytes_a_vertex"] = peak / vertices;
}
BENCHMARK(session_memory)->Arg(100)->Arg(200)->Arg(316)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace lpdeform
