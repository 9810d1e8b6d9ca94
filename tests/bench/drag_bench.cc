// A drag in a live session: how long a handle's move takes to its first useful state, with E^(1/p) within 5 % of the converged
// one. It starts from the state that the previous move had reached by then. 30 moves bend a bumpy sheet. A second solver
// computes the converged energies, for at most 10 s per move. Prints percentiles in milliseconds; set-up is reported
// separately. `paced` makes the same moves, each 33 ms after the one before, ready or not: how far above the minimum frames are, and
// how long the last move takes. `first` makes single moves from rest, on sheets of several sizes: what one mesh takes may be luck.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <vector>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

constexpr int kMoves = 30;
constexpr double kUseful = 1.05;
constexpr double kLongest = 10;  // seconds that the second solver has for a move

HandleSet handles_at(const TriangleMesh& mesh, int side, double share) {
  HandleSet handles;
  (void)handles.set("left", {slice(mesh, 0, 0, 0), Fixed{}});
  (void)handles.set(
      "right", {slice(mesh, 0, side, side), turn(Eigen::Vector3d::UnitY(), -90 * share, {0.5 * side, 0, 0},
                                                 Eigen::Vector3d(0, 0, 0.2 * side * share))});
  return handles;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Seconds until E^(1/p) <= `enough`, or to the end of the solve.
double time_to(Deformer& deformer, const HandleSet& handles, double p, double enough) {
  const auto start = std::chrono::steady_clock::now();
  SolveSettings settings{.effort = 0};  // as in a live session
  settings.keep_trace = false;
  (void)deformer.set_handles(handles);
  (void)deformer.start(settings);
  while (std::pow(deformer.summary().energy, 1 / p) > enough && deformer.step()) {
  }
  benchmark::DoNotOptimize(deformer.positions().data());
  return seconds_since(start);
}

/// What a run is about: a bumpy sheet with `side` cells along an edge, and p.
struct Sheet {
  explicit Sheet(const benchmark::State& state)
      : side(static_cast<int>(state.range(0))), p(static_cast<double>(state.range(1)) / 10) {}

  HandleSet after(int moves) const { return handles_at(mesh, side, double(moves) / kMoves); }
  HandleSet bent(double degrees) const { return handles_at(mesh, side, degrees / 90); }
  std::unique_ptr<Deformer> at_rest() const {
    auto result = deformer(shape, after(0), Material::uniform(p), {.threads = 2});
    (void)result->solve({});
    return result;
  }

  int side;
  double p;
  TriangleMesh mesh = grid(side, side, 2);
  std::shared_ptr<const RestShape> shape = rest_shape(mesh);
};

void drag(benchmark::State& state) {
  const Sheet sheet(state);
  const double p = sheet.p;
  std::vector<double> times;
  for (auto _ : state) {
    const auto live = sheet.at_rest(), converged = sheet.at_rest();
    for (int move = 1; move <= kMoves; ++move) {
      const HandleSet handles = sheet.after(move);
      (void)converged->set_handles(handles);
      const double best = converged->solve({.time_limit_seconds = kLongest, .effort = 0}).value().energy;
      times.push_back(time_to(*live, handles, p, kUseful * std::pow(best, 1 / p)));
    }
  }
  state.counters["first_ms"] = 1e3 * times.front();  // from rest
  state.counters["second_ms"] = 1e3 * times[1];
  std::ranges::sort(times);
  state.counters["p50_ms"] = 1e3 * times[times.size() / 2];
  state.counters["p99_ms"] = 1e3 * times[times.size() * 99 / 100];
  state.counters["vertices"] = sheet.shape->vertex_count();
}

/// Every sixth frame is measured against a second solver, which goes on from the last frame it had.
void paced(benchmark::State& state) {
  constexpr double kPace = 0.033;
  const Sheet sheet(state);
  const double p = sheet.p;
  std::vector<double> above, frames;
  double useful = 0, near = 0;
  for (auto _ : state) {
    const auto live = sheet.at_rest(), converged = sheet.at_rest();
    const auto best_at = [&](int move) {
      (void)converged->set_handles(sheet.after(move));
      return std::pow(converged->solve({.time_limit_seconds = kLongest, .effort = 0}).value().energy, 1 / p);
    };
    for (int move = 1; move < kMoves; ++move) {
      const auto start = std::chrono::steady_clock::now();
      (void)live->set_handles(sheet.after(move));
      (void)live->start({.effort = 0});
      while (seconds_since(start) < kPace && live->step()) {
      }
      live->catch_up(false);
      frames.push_back(seconds_since(start));
      if (move % 6 == 0) above.push_back(std::pow(live->summary().energy, 1 / p) / best_at(move));
    }
    const double best = best_at(kMoves);
    useful = time_to(*live, sheet.after(kMoves), p, kUseful * best);
    const auto start = std::chrono::steady_clock::now();
    while (std::pow(live->summary().energy, 1 / p) > 1.01 * best && live->step()) {
    }
    near = useful + seconds_since(start);
  }
  std::ranges::sort(frames);
  state.counters["above"] = above[above.size() / 2];
  state.counters["above_worst"] = *std::ranges::max_element(above);
  state.counters["frame_ms"] = 1e3 * frames[frames.size() / 2];
  state.counters["last_5%_ms"] = 1e3 * useful;
  state.counters["last_1%_ms"] = 1e3 * near;
  state.counters["vertices"] = sheet.shape->vertex_count();
}

void first(benchmark::State& state) {
  const Sheet sheet(state);
  std::vector<double> times;
  for (auto _ : state) {
    for (const double degrees : {1.5, 2.0, 3.0, 4.5}) {
      const auto live = sheet.at_rest(), converged = sheet.at_rest();
      (void)converged->set_handles(sheet.bent(degrees));
      const double best = converged->solve({.time_limit_seconds = kLongest, .effort = 0}).value().energy;
      times.push_back(time_to(*live, sheet.bent(degrees), sheet.p, kUseful * std::pow(best, 1 / sheet.p)));
    }
  }
  std::ranges::sort(times);
  state.counters["shortest_ms"] = 1e3 * times.front();
  state.counters["median_ms"] = 1e3 * (times[1] + times[2]) / 2;
  state.counters["longest_ms"] = 1e3 * times.back();
  state.counters["vertices"] = sheet.shape->vertex_count();
}

BENCHMARK(paced)
    ->ArgsProduct({{316}, {10, 15, 20, 60}})
    ->ArgNames({"side", "ten_p"})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

BENCHMARK(first)
    ->ArgsProduct({{240, 260, 290, 316, 340}, {15, 20, 60}})
    ->ArgNames({"side", "ten_p"})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

BENCHMARK(drag)
    ->ArgsProduct({{100, 316}, {10, 15, 20, 60}})
    ->ArgNames({"side", "ten_p"})
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace lpdeform
