// What it costs the server to encode a frame, and the frame's size, by format.

#include <benchmark/benchmark.h>

#include <cmath>

#include "server/session/frame.h"

namespace lpdeform {
namespace {

/// A sheet of so many vertices, rolled.
Points rolled(Eigen::Index side) {
  Points points(side * side, 3);
  for (Eigen::Index k = 0; k < points.rows(); ++k) {
    const double x = static_cast<double>(k % side), angle = 2 * x / static_cast<double>(side);
    const double radius = static_cast<double>(side) / 2;
    points.row(k) << radius * std::sin(angle), static_cast<double>(k / side), radius * (1 - std::cos(angle));
  }
  return points;
}

void encode(benchmark::State& state, Format format) {
  const auto side = static_cast<Eigen::Index>(std::lround(std::sqrt(static_cast<double>(state.range(0)))));
  const Points points = rolled(side);
  const Field distortion = points.col(2).array().square() / 1e4;
  std::size_t bytes = 0;
  for (auto _ : state) {
    const Surface surface(points, distortion);
    bytes = 0;
    const std::uint32_t most = Surface::vertices_a_part(format, true, false);
    for (std::uint32_t first = 0; first < surface.vertex_count(); first += most) {
      const std::uint32_t count = std::min(most, surface.vertex_count() - first);
      bytes += surface.bytes(format, first, count, true, false).size();
    }
    benchmark::DoNotOptimize(bytes);
  }
  state.counters["bytes_a_vertex"] = static_cast<double>(bytes) / static_cast<double>(points.rows());
}

BENCHMARK_CAPTURE(encode, float32, Format::kFloat32)
    ->Arg(10'000)
    ->Arg(100'000)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(encode, quantized, Format::kQuantized)
    ->Arg(10'000)
    ->Arg(100'000)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(encode, compressed, Format::kCompressed)
    ->Arg(10'000)
    ->Arg(100'000)
    ->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace lpdeform
