// Cold solves of several poses of one mesh; see families.
//
//   families_bench FAMILY VERTICES P[,P...] POSES THREADS SECONDS [EFFORT]      a line of JSON for each pose and p
//
// FAMILY is creature, scan, tree or sheet (families.h). "trace" has the seconds of solving and E^(1/p) after every iteration
// that has lowered it by 0.2 %, and at the end.

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_split.h"
#include "tests/bench/scale/families.h"

namespace {

using namespace lpdeform;

constexpr double kWorthALine = 0.998;

void print_trace(const std::vector<IterationRecord>& trace, double p) {
  double last = 0;
  for (std::size_t k = 0; k < trace.size(); ++k) {
    const double energy = std::pow(trace[k].energy, 1 / p);
    const bool is_shown = k == 0 || k + 1 == trace.size() || energy < kWorthALine * last;
    if (!is_shown) continue;
    std::printf("%s[%.5g, %.8g]", k == 0 ? "" : ", ", trace[k].seconds, energy);
    last = energy;
  }
}

void solve(Deformer& deformer, double p, double limit, std::optional<int> effort) {
  (void)deformer.set_material(Material::uniform(p));
  SolveSettings settings;
  settings.initial = InitialGuess::kLaplacian;
  settings.time_limit_seconds = limit;
  settings.keep_trace = true;
  settings.effort = effort;
  const auto start = std::chrono::steady_clock::now();
  const SolveSummary summary = deformer.solve(settings).value();
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  std::printf("\"p\": %g, \"stop\": \"%s\", \"set_up\": %.5g, \"trace\": [", p,
              std::string(stop_reason_name(summary.stop_reason)).c_str(),
              took.count() - summary.solve_seconds);
  print_trace(summary.trace, p);
  std::printf("]}\n");
  std::fflush(stdout);
}

}  // namespace

int main(int count, char** arguments) {
  std::vector<double> exponents;
  int poses = 0, threads = 0, effort = 0;
  double vertices = 0, seconds = 0;
  bool is_good = (count == 7 || (count == 8 && absl::SimpleAtoi(arguments[7], &effort))) &&
                 absl::SimpleAtod(arguments[2], &vertices) && absl::SimpleAtoi(arguments[4], &poses) &&
                 absl::SimpleAtoi(arguments[5], &threads) && absl::SimpleAtod(arguments[6], &seconds);
  if (is_good) {
    for (const auto p : absl::StrSplit(arguments[3], ','))
      is_good = absl::SimpleAtod(p, &exponents.emplace_back()) && is_good;
  }
  if (!is_good) {
    std::fprintf(stderr, "families_bench FAMILY VERTICES P[,P...] POSES THREADS SECONDS [EFFORT]\n");
    return 2;
  }
  const TriangleMesh mesh = family_of(arguments[1], vertices);
  const auto shape = RestShape::create(mesh).value();
  for (int pose = 0; pose < poses; ++pose) {
    const auto deformer = Deformer::create(shape, {.threads = threads}).value();
    if (!deformer->set_handles(family_pose(mesh, static_cast<unsigned>(pose))).ok()) continue;
    for (const double p : exponents) {
      std::printf("{\"vertices\": %td, \"pose\": %d, ", mesh.vertices.rows(), pose);
      solve(*deformer, p, seconds, count == 8 ? std::make_optional(effort) : std::nullopt);
    }
  }
}
