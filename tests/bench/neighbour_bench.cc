// The rate of a small session next to a large one: how long the small bar's updates take to their converged frames, alone and
// while a session of 100k vertices factors and solves all the time. Prints percentiles in milliseconds and the ratio of the
// medians. Both parts run in one process, one after the other.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <iostream>
#include <thread>
#include <vector>

#include "client/cpp/client.h"
#include "core/shapes/shapes.h"
#include "server/server.h"

namespace lpdeform::client {
namespace {

constexpr int kUpdates = 200;
constexpr std::chrono::minutes kPatience{5};

Mesh to_mesh(const TriangleMesh& mesh) {
  Mesh out;
  out.vertices.assign(mesh.vertices.data(), mesh.vertices.data() + mesh.vertices.size());
  out.faces.assign(mesh.faces.data(), mesh.faces.data() + mesh.faces.size());
  return out;
}

/// Holds the two ends along an axis; "end" is the one to move.
Update ends(const Mesh& mesh, std::size_t axis) {
  double low = mesh.vertices[axis], high = low;
  for (std::size_t k = axis; k < mesh.vertices.size(); k += 3) {
    low = std::min(low, mesh.vertices[k]);
    high = std::max(high, mesh.vertices[k]);
  }
  Handle base, end;
  for (std::size_t k = 0; k < mesh.vertex_count(); ++k) {
    const double at = mesh.vertices[3 * k + axis];
    if (at == low) base.vertices.push_back(static_cast<std::uint32_t>(k));
    if (at == high) end.vertices.push_back(static_cast<std::uint32_t>(k));
  }
  Update update;
  update.handles.emplace("base", base);
  update.handles.emplace("end", end);
  return update;
}

std::vector<double> latencies(Session& session) {
  std::vector<double> out;
  for (int k = 0; k < kUpdates; ++k) {
    const auto begin = std::chrono::steady_clock::now();
    (void)session.move("end", RigidMotion{.translation = {0.05 * (k % 40), 0, 0}});
    (void)session.settle(kPatience).value();
    out.push_back(
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  std::ranges::sort(out);
  return out;
}

void small_beside_large(benchmark::State& state) {
  ServerOptions options;
  options.address = "localhost:0";
  const auto server = Server::start(options).value();
  const Client client = Client::connect(server->address()).value();
  for (auto _ : state) {
    const Mesh small_mesh = to_mesh(box_surface(4, 4, 21)), large_mesh = to_mesh(grid(399, 249));
    Session small = Client(client).open(small_mesh).value();
    (void)small.update(ends(small_mesh, 2));
    (void)small.settle(kPatience).value();
    const std::vector<double> alone = latencies(small);

    Session large = Client(client).open(large_mesh).value();
    std::atomic<bool> is_over = false;
    std::atomic<int> frames = 0;
    std::jthread dragging([&] {
      Update update = ends(large_mesh, 0);
      update.settings.p = 1.5;
      for (int k = 0; !is_over; ++k) {
        (void)large.update(update);  // handles set again: factored again
        (void)large.move("end", RigidMotion{.translation = {0, 0, 1.0 * (k % 80)}});
        for (int n = 0; n < 5 && !is_over; ++n) {
          frames += large.next_frame(std::chrono::milliseconds(200)).ok();
        }
      }
    });
    while (frames == 0) std::this_thread::yield();
    const std::vector<double> beside = latencies(small);
    is_over = true;
    dragging.join();

    state.counters["alone_p50_ms"] = alone[kUpdates / 2];
    state.counters["alone_p99_ms"] = alone[kUpdates * 99 / 100];
    state.counters["beside_p50_ms"] = beside[kUpdates / 2];
    state.counters["beside_p99_ms"] = beside[kUpdates * 99 / 100];
    state.counters["median_ratio"] = beside[kUpdates / 2] / alone[kUpdates / 2];
    state.counters["large_frames"] = frames.load();
  }
}
BENCHMARK(small_beside_large)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace lpdeform::client
