// The time that an automatic field and a resize wait for, once per session: thickness by rays, joints (thickness, two
// factorisations, four solves) and smoothed bending (one factorisation, two solves). Measured on closed boxes of about 10,000
// and 110,000 vertices.

#include <benchmark/benchmark.h>

#include "core/analysis/joints.h"
#include "core/analysis/salience.h"
#include "core/analysis/thickness.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

std::shared_ptr<const RestShape> box_of(const benchmark::State& state) {
  const auto side = static_cast<int>(state.range(0));
  return rest_shape(box_surface(side, side, 4 * side));
}

template <typename Analysis>
void analyse(benchmark::State& state, Analysis analysis) {
  const auto shape = box_of(state);
  const Workers workers(static_cast<int>(state.range(1)));
  for (auto _ : state) analysis(*shape, workers);
  state.counters["vertices"] = shape->vertex_count();
}

void thickness(benchmark::State& state) {
  analyse(state, [](const RestShape& shape, const Workers& workers) {
    benchmark::DoNotOptimize(thickness_behind_faces(shape, workers));
  });
}

void joints(benchmark::State& state) {
  analyse(state, [](const RestShape& shape, const Workers& workers) {
    benchmark::DoNotOptimize(find_joints(shape, workers));
  });
}

void bending(benchmark::State& state) {
  analyse(state,
          [](const RestShape& shape, const Workers&) { benchmark::DoNotOptimize(smoothed_bending(shape)); });
}

void on_boxes(benchmark::internal::Benchmark* benchmark) {
  benchmark->ArgsProduct({{24, 78}, {1, 2}})->ArgNames({"side", "threads"});
  benchmark->MeasureProcessCPUTime()->UseRealTime()->Unit(benchmark::kMillisecond);
}
BENCHMARK(thickness)->Apply(on_boxes);
BENCHMARK(joints)->Apply(on_boxes);
BENCHMARK(bending)->Apply(on_boxes);

}  // namespace
}  // namespace lpdeform
