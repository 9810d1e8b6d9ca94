// What the service adds to a move's solve: the time from a move to its result, by the C++ client over a socket of this machine
// and in this process. Both get the same moves of the same sheet, in turns. Prints medians in milliseconds, and their ratio.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <vector>

#include "client/cpp/client.h"
#include "server/server.h"
#include "tests/core/poses.h"

namespace lpdeform {
namespace {

constexpr int kMoves = 40;
constexpr int kThreads = 2;
constexpr double kP = 1.5;
constexpr std::chrono::seconds kPatience{120};

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <typename Work>
double milliseconds_of(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

client::Handle handle_of(const std::vector<std::int32_t>& vertices) {
  return {.vertices = {vertices.begin(), vertices.end()}};
}

client::Session open(const Server& server, const TriangleMesh& mesh) {
  const client::Mesh copy{{mesh.vertices.data(), mesh.vertices.data() + mesh.vertices.size()},
                          {mesh.faces.data(), mesh.faces.data() + mesh.faces.size()}};
  return client::Client::connect(server.address()).value().open(copy, {.settings = {.p = kP}}).value();
}

void move(benchmark::State& state) {
  const auto side = static_cast<int>(state.range(0));
  const TriangleMesh mesh = grid(side, side, 2);
  const auto left = slice(mesh, 0, 0, 0), right = slice(mesh, 0, side, side);
  ServerOptions options;
  options.threads = kThreads;
  const auto server = Server::start(options).value();
  std::vector<double> served, in_process;
  for (auto _ : state) {
    client::Session session = open(*server, mesh);
    (void)session.set_handle("left", handle_of(left));
    (void)session.set_handle("right", handle_of(right));
    (void)session.settle(kPatience).value();
    HandleSet handles;
    (void)handles.set("left", {left, Fixed{}});
    (void)handles.set("right", {right, Fixed{}});
    const auto here = deformer(rest_shape(mesh), handles, Material::uniform(kP), {.threads = kThreads});
    (void)here->solve({});
    for (int k = 1; k <= kMoves; ++k) {
      const Eigen::Vector3d by(0, 0, 0.002 * side * k);
      served.push_back(milliseconds_of([&] {
        (void)session.move("right", client::RigidMotion{.translation = {by[0], by[1], by[2]}});
        (void)session.settle(kPatience).value();
      }));
      in_process.push_back(milliseconds_of([&] {
        (void)handles.set_motion("right", RigidMotion{.translation = by});
        (void)here->set_handles(handles);
        benchmark::DoNotOptimize(here->solve({}).value().energy);
      }));
    }
  }
  state.counters["vertices"] = static_cast<double>(mesh.vertices.rows());
  state.counters["served_ms"] = median(served);
  state.counters["in_process_ms"] = median(in_process);
  state.counters["ratio"] = median(served) / median(in_process);
}
BENCHMARK(move)->Arg(31)->Arg(99)->Iterations(1)->Unit(benchmark::kSecond);

}  // namespace
}  // namespace lpdeform
