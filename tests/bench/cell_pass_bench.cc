// The parts of an iteration: the rotation fit compared with plain SVD, the cell pass on one and two threads, the metric, and loops
// beside many sessions.

#include <benchmark/benchmark.h>

#include <chrono>
#include <random>
#include <thread>
#include <vector>

#include "core/constraints/metric.h"
#include "core/energy/cell_pass.h"
#include "core/energy/rotation_fit.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

std::vector<Eigen::Matrix3d> random_matrices() {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Matrix3d> result(1000);
  for (auto& matrix : result) {
    matrix = Eigen::Matrix3d::Identity() + 0.3 * Eigen::Matrix3d::NullaryExpr([&] { return normal(random); });
  }
  return result;
}

template <typename Fit>
void fit_all(benchmark::State& state, Fit fit) {
  const auto matrices = random_matrices();
  for (auto _ : state) {
    for (const auto& matrix : matrices) benchmark::DoNotOptimize(fit(matrix));
  }
  state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(matrices.size()));
}
void fit_closed_form(benchmark::State& state) {
  fit_all(state, fit_rotation);
}
void fit_svd(benchmark::State& state) {
  fit_all(state, fit_rotation_svd);
}
BENCHMARK(fit_closed_form);
BENCHMARK(fit_svd);

void cell_pass(benchmark::State& state) {
  const auto shape = rest_shape(box_surface(2, 100, 200));
  const LpNorm norm(Material::uniform(1.5), shape->vertex_count(), shape->mean_edge_length(), 1);
  CellPass cells(shape, Workers(static_cast<int>(state.range(0))));
  const Points x = shaken(shape->scaled_positions(), 0.2);
  Points gradient;
  for (auto _ : state) {
    benchmark::DoNotOptimize(cells.evaluate(x, norm));
    cells.gradient(gradient);
  }
  state.SetItemsProcessed(state.iterations() * shape->vertex_count());
}
BENCHMARK(cell_pass)->Arg(1)->Arg(2)->UseRealTime()->Unit(benchmark::kMillisecond);

struct FactoredMetric {
  explicit FactoredMetric(int side)
      : shape(rest_shape(grid(side, side, 2))), metric(Metric::create(shape).value()) {
    is_held.assign(shape->vertex_count(), false);
    is_held[0] = true;
  }
  bool factor(double weight, int threads = 1, Metric::Precision precision = Metric::Precision::kSingle) {
    std::vector<double> weights(shape->vertex_count(), 1.0);
    weights[0] = weight;
    return metric.factor(weights, is_held, {}, Workers(threads), precision);
  }
  std::shared_ptr<const RestShape> shape;
  Metric metric;
  std::vector<char> is_held;
};

/// 0 threads stand for double precision, which has one.
void metric_factor(benchmark::State& state) {
  FactoredMetric test(static_cast<int>(state.range(0)));
  const int threads = static_cast<int>(state.range(1));
  const auto precision = threads == 0 ? Metric::Precision::kDouble : Metric::Precision::kSingle;
  double weight = 1;
  for (auto _ : state)  // never the same twice running
    benchmark::DoNotOptimize(test.factor(weight = 3 - weight, std::max(1, threads), precision));
}
BENCHMARK(metric_factor)
    ->ArgsProduct({{63, 200, 316}, {0, 1, 2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

void metric_solve(benchmark::State& state) {
  FactoredMetric test(static_cast<int>(state.range(0)));
  if (!test.factor(1)) return state.SkipWithError("not positive definite");
  const Points b = Points::Random(test.shape->vertex_count(), 3);
  Points x;
  for (auto _ : state) test.metric.solve(b, x, Workers(1));
}
BENCHMARK(metric_solve)->Arg(63)->Arg(200)->Arg(316)->Unit(benchmark::kMillisecond);

void metric_precondition(benchmark::State& state) {
  FactoredMetric test(static_cast<int>(state.range(0)));
  if (!test.factor(1)) return state.SkipWithError("not positive definite");
  const Points b = Points::Random(test.shape->vertex_count(), 3);
  Points x;
  const Workers workers(static_cast<int>(state.range(1)));
  for (auto _ : state) test.metric.precondition(b, x, workers);
}
BENCHMARK(metric_precondition)
    ->ArgsProduct({{63, 200, 316}, {1, 2}})
    ->UseRealTime()
    ->Unit(benchmark::kMillisecond);

/// A short loop on two threads. So many other Workers have run one before, as open sessions have. In the pause before each loop its
/// threads fall asleep.
void loop_beside_others(benchmark::State& state) {
  std::vector<Workers> others(static_cast<std::size_t>(state.range(0)), Workers(2));
  std::vector<double> sums(8);
  const auto run = [&](const Workers& workers) {
    workers.for_chunks(8, 1, [&](std::size_t k, std::size_t, std::size_t) {
      for (int i = 0; i < 20000; ++i) benchmark::DoNotOptimize(sums[k] += i);
    });
  };
  for (Workers& other : others) run(other = Workers(2));
  for (auto _ : state) {
    state.PauseTiming();
    std::this_thread::sleep_for(std::chrono::microseconds(300));
    state.ResumeTiming();
    run(others[others.size() / 2]);
  }
}
BENCHMARK(loop_beside_others)->Arg(1)->Arg(1000)->Arg(5000)->UseRealTime()->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace lpdeform
