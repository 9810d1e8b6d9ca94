// A call of lpdeform::core::deform, for call_overhead.py:
//
//   core_call MESH.off HANDLES.txt P CALLS
//
// HANDLES.txt has a line "vertex x y z" for every held vertex. Prints the seconds of each call.

#include <lpdeform/core.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>

int main(int argc, char** argv) {
  using namespace lpdeform::core;
  using Clock = std::chrono::steady_clock;
  if (argc != 5) return 2;
  const auto mesh = read_mesh(argv[1]);
  if (!mesh.ok()) {
    std::fprintf(stderr, "%s\n", mesh.error().text.c_str());
    return 1;
  }
  Handle held;
  TargetPositions targets;
  std::ifstream handles(argv[2]);
  std::uint32_t vertex = 0;
  double x = 0, y = 0, z = 0;
  while (handles >> vertex >> x >> y >> z) {
    held.vertices.push_back(vertex);
    targets.positions.insert(targets.positions.end(), {x, y, z});
  }
  held.motion = targets;
  for (int call = 0; call < std::atoi(argv[4]); ++call) {
    const auto start = Clock::now();
    const auto result = deform(*mesh, {{"held", held}}, {.p = std::atof(argv[3])});
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    if (!result.ok()) {
      std::fprintf(stderr, "%s\n", result.error().text.c_str());
      return 1;
    }
    std::printf("%.9f %d\n", seconds, result->iterations);
  }
}
