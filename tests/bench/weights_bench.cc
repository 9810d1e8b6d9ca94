// Clamped cotangent weights compared with intrinsic Delaunay weights on meshes with many obtuse triangles: time to prepare the
// rest shape, clamped and flipped edges, iterations and time to converge, and E^(1/p). For the plate also the distance from the
// result of the same vertices with a good triangulation: root-mean-square distance over the diagonal.

#include <benchmark/benchmark.h>

#include <chrono>
#include <cmath>

#include "tests/core/poses.h"

namespace lpdeform {
namespace {

struct Pose {
  TriangleMesh mesh;
  HandleSet handles;
  TriangleMesh reference;  // the same vertices, well triangulated; may be empty
};

HandleSet bent(const TriangleMesh& mesh, int axis) {
  const double low = mesh.vertices.col(axis).minCoeff(), high = mesh.vertices.col(axis).maxCoeff();
  const double end = 0.05 * (high - low);
  const Eigen::Vector3d centre = mesh.vertices.colwise().mean().transpose();
  HandleSet handles;
  (void)handles.set("fixed", {slice(mesh, axis, low, low + end), Fixed{}});
  (void)handles.set("moved", {slice(mesh, axis, high - end, high),
                              turn(Eigen::Vector3d::Unit((axis + 1) % 3), 60, centre)});
  return handles;
}

Pose plate() {
  const TriangleMesh good = grid(50, 50);
  return {slanted_plate(50, 5), bent(good, 0), good};
}

/// Its triangles get thin in one direction.
Pose pressed_creature() {
  TriangleMesh mesh = creature(60);
  mesh.vertices.col(1) *= 0.15;
  return {mesh, bent(mesh, 0), {}};
}

Points solved(const TriangleMesh& mesh, const HandleSet& handles, WeightKind kind, double p) {
  auto one = deformer(rest_shape(mesh, kind), handles, Material::uniform(p));
  (void)one->solve({});
  return one->positions();
}

void weights(benchmark::State& state, Pose (*make)(), WeightKind kind) {
  const double p = static_cast<double>(state.range(0)) / 10;
  const Pose pose = make();
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    const auto shape = rest_shape(pose.mesh, kind);
    const std::chrono::duration<double> prepare = std::chrono::steady_clock::now() - start;
    const auto one = deformer(shape, pose.handles, Material::uniform(p));
    const SolveSummary summary = one->solve({}).value();
    state.counters["edges"] = static_cast<double>(shape->report().edges);
    state.counters["clamped"] = static_cast<double>(shape->report().clamped_edges.count);
    state.counters["flipped"] = static_cast<double>(shape->report().flipped_edges.count);
    state.counters["prepare_ms"] = 1e3 * prepare.count();
    state.counters["solve_ms"] = 1e3 * summary.solve_seconds;
    state.counters["iterations"] = summary.iterations;
    state.counters["length"] = std::pow(summary.energy, 1 / p);
    if (pose.reference.faces.rows() == 0) continue;
    const Points other = solved(pose.reference, pose.handles, WeightKind::kCotangent, p);
    const double rows = static_cast<double>(other.rows());
    state.counters["rms_error"] = (one->positions() - other).norm() / std::sqrt(rows) / shape->diagonal();
  }
}

#define LPDEFORM_WEIGHTS(pose, name, kind)                 \
  BENCHMARK_CAPTURE(weights, pose##_##name, &(pose), kind) \
      ->ArgName("ten_p")                                   \
      ->Arg(10)                                            \
      ->Arg(20)                                            \
      ->Arg(60)                                            \
      ->Iterations(1)                                      \
      ->Unit(benchmark::kMillisecond)
LPDEFORM_WEIGHTS(plate, clamped, WeightKind::kCotangent);
LPDEFORM_WEIGHTS(plate, intrinsic, WeightKind::kIntrinsicDelaunay);
LPDEFORM_WEIGHTS(pressed_creature, clamped, WeightKind::kCotangent);
LPDEFORM_WEIGHTS(pressed_creature, intrinsic, WeightKind::kIntrinsicDelaunay);

}  // namespace
}  // namespace lpdeform
