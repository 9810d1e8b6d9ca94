// Cold solves of the sixty problems of minima; see run.
//
//   minima_bench METHOD EFFORT SECONDS [FROM TO]      a line of JSON for each problem, of the numbers FROM to TO - 1
//
// EFFORT may be "default".

#include <cstdio>
#include <ctime>
#include <string>
#include <string_view>

#include "absl/strings/numbers.h"
#include "core/solve/deformer.h"
#include "tests/bench/minima/problems.h"

namespace {

using namespace lpdeform;

double processor_seconds() {
  return static_cast<double>(std::clock()) / CLOCKS_PER_SEC;
}

void solve(int number, const SolveSettings& settings) {
  const MinimaProblem problem = minima_problem(number);
  const auto shape = RestShape::create(problem.mesh).value();
  const auto deformer = Deformer::create(shape, {}).value();
  if (const absl::Status status = deformer->set_handles(problem.handles); !status.ok()) {
    std::fprintf(stderr, "%s: %s\n", problem.name.c_str(), std::string(status.message()).c_str());
    return;
  }
  (void)deformer->set_material(problem.material);
  const double begun = processor_seconds();
  const auto solved = deformer->solve(settings);
  if (!solved.ok()) {  // conic and local_global take one p only
    std::fprintf(stderr, "%s: %s\n", problem.name.c_str(), std::string(solved.status().message()).c_str());
    return;
  }
  const SolveSummary& summary = *solved;
  std::printf(
      "{\"problem\": \"%s\", \"vertices\": %td, \"energy\": %.10g, \"stop\": \"%s\", \"starts\": %d, "
      "\"minima\": [",
      problem.name.c_str(), problem.mesh.vertices.rows(), summary.energy,
      std::string(stop_reason_name(summary.stop_reason)).c_str(), summary.further_starts);
  for (std::size_t k = 0; k < summary.minima.size(); ++k)
    std::printf("%s%.10g", k == 0 ? "" : ", ", summary.minima[k]);
  std::printf("], \"seconds\": %.3f}\n", processor_seconds() - begun);
  std::fflush(stdout);
}

}  // namespace

int main(int count, char** arguments) {
  SolveSettings settings{.initial = InitialGuess::kLaplacian};
  int effort = 0, from = 0, to = 60;
  bool is_good = (count == 4 || count == 6) && method_named(arguments[1]).has_value() &&
                 absl::SimpleAtod(arguments[3], &settings.time_limit_seconds);
  if (is_good && std::string_view(arguments[2]) != "default") {
    is_good = absl::SimpleAtoi(arguments[2], &effort);
    settings.effort = effort;
  }
  if (is_good && count == 6)
    is_good = absl::SimpleAtoi(arguments[4], &from) && absl::SimpleAtoi(arguments[5], &to);
  if (!is_good) {
    std::fprintf(stderr, "minima_bench METHOD EFFORT SECONDS [FROM TO]\n");
    return 2;
  }
  settings.method = *method_named(arguments[1]);
  for (int number = from; number < to; ++number) solve(number, settings);
}
