// CGAL's Surface_mesh_deformation (ORIGINAL_ARAP) on one task, one iteration at a time.
//
//   cgal_peer MESH.off HANDLES.txt SECONDS OUT
//
// HANDLES.txt: a line "vertex x y z" for every held vertex. Writes OUT.json, the seconds of set-up and of every
// iteration, and OUT.f64, the positions after the iterations that OUT.json lists as kept (n x 3 doubles each). Its
// first iteration is the Laplacian deformation. It ends early where from one kept state to the next, 5 % more
// iterations, no coordinate changes by 1e-7 of the farthest one.

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_deformation.h>
#include <CGAL/boost/graph/IO/OFF.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

namespace {

using Kernel = CGAL::Simple_cartesian<double>;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Deformation = CGAL::Surface_mesh_deformation<Mesh, CGAL::Default, CGAL::Default, CGAL::ORIGINAL_ARAP>;
using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void write_numbers(std::FILE* file, const char* name, const std::vector<double>& numbers) {
  std::fprintf(file, "\"%s\": [", name);
  for (std::size_t k = 0; k < numbers.size(); ++k) std::fprintf(file, "%s%.9g", k ? ", " : "", numbers[k]);
  std::fprintf(file, "]");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return std::fprintf(stderr, "usage: cgal_peer MESH.off HANDLES.txt SECONDS OUT\n"), 2;
  Mesh mesh;
  if (!CGAL::IO::read_OFF(argv[1], mesh)) return std::fprintf(stderr, "cannot read %s\n", argv[1]), 1;
  std::ifstream handles(argv[2]);
  const double limit = std::atof(argv[3]);
  const std::string out = argv[4];

  Clock::time_point start = Clock::now();
  Deformation deformation(mesh);
  deformation.insert_roi_vertices(vertices(mesh).begin(), vertices(mesh).end());
  std::vector<std::pair<Mesh::Vertex_index, Kernel::Point_3>> targets;
  std::size_t vertex;
  double x, y, z;
  while (handles >> vertex >> x >> y >> z)
    targets.emplace_back(Mesh::Vertex_index(vertex), Kernel::Point_3(x, y, z));
  for (const auto& target : targets) deformation.insert_control_vertex(target.first);
  if (!deformation.preprocess()) return std::fprintf(stderr, "preprocess failed\n"), 1;
  for (const auto& target : targets) deformation.set_target_position(target.first, target.second);
  const double setup = seconds_since(start);

  std::FILE* positions = std::fopen((out + ".f64").c_str(), "wb");
  std::vector<double> seconds, kept, before(3 * num_vertices(mesh));
  double total = 0;
  bool is_at_rest = false;
  for (int iteration = 1; total < limit && !is_at_rest; ++iteration) {
    start = Clock::now();
    deformation.deform(1, 0);
    total += seconds_since(start);
    seconds.push_back(total);
    if (!kept.empty() && iteration < 1.05 * kept.back()) continue;
    kept.push_back(iteration);
    double farthest = 0, change = 0;
    std::size_t at = 0;
    for (const auto v : vertices(mesh)) {
      for (int c = 0; c < 3; ++c, ++at) {
        const double coordinate = mesh.point(v)[c];
        farthest = std::max(farthest, std::abs(coordinate));
        change = std::max(change, std::abs(coordinate - before[at]));
        before[at] = coordinate;
      }
    }
    std::fwrite(before.data(), sizeof(double), before.size(), positions);
    is_at_rest = kept.size() > 20 && change < 1e-7 * farthest;
  }
  std::fclose(positions);
  std::FILE* json = std::fopen((out + ".json").c_str(), "w");
  std::fprintf(json, "{\"setup\": %.9g, ", setup);
  write_numbers(json, "seconds", seconds);
  std::fprintf(json, ", ");
  write_numbers(json, "kept", kept);
  std::fprintf(json, "}\n");
  std::fclose(json);
  return 0;
}
