// The cost of a change of the held vertices: one more patch is held on a mesh that is factored already. Three ways are
// compared with the whole set-up:
//
//   refactor     numeric factorisation on the kept pattern, as Metric does it
//   rows         CHOLMOD's row updates of a simplicial factor, a row deleted for each vertex of the patch
//   subtrees     numeric factorisation of only those columns that the patch reaches in the elimination tree. It is not
//                implemented; the counter gives the share of the operations that it would repeat
//
// The patch has the same share of the body for every mesh size.

#include <benchmark/benchmark.h>
#include <cholmod.h>

#include <algorithm>
#include <map>
#include <vector>

#include "tests/bench/creature_pose.h"

namespace lpdeform {
namespace {

/// L of one coordinate on all vertices, lower triangle, some diagonal added so that it is positive definite.
struct Laplacian {
  explicit Laplacian(const RestShape& shape) {
    const std::int32_t n = shape.vertex_count();
    columns.push_back(0);
    for (std::int32_t i = 0; i < n; ++i) {
      double diagonal = 1e-3;
      const std::size_t at = rows.size();
      rows.push_back(i);
      values.push_back(0);
      for (std::int32_t k = shape.offsets()[i]; k < shape.offsets()[i + 1]; ++k) {
        diagonal += shape.weights()[k];
        if (shape.neighbours()[k] < i) continue;
        rows.push_back(shape.neighbours()[k]);
        values.push_back(-shape.weights()[k]);
      }
      values[at] = diagonal;
      columns.push_back(static_cast<std::int32_t>(rows.size()));
    }
    view.nrow = view.ncol = static_cast<std::size_t>(n);
    view.nzmax = rows.size();
    view.p = columns.data(), view.i = rows.data(), view.x = values.data();
    view.stype = -1;
    view.itype = CHOLMOD_INT, view.xtype = CHOLMOD_REAL, view.dtype = CHOLMOD_DOUBLE;
    view.sorted = view.packed = 1;
  }
  std::vector<std::int32_t> columns, rows;
  std::vector<double> values;
  cholmod_sparse view{};
};

struct Case {
  explicit Case(double vertices)
      : mesh(creature_of(vertices)), shape(rest_shape(mesh)), held(creature_patch(mesh, 0.4)) {}
  TriangleMesh mesh;
  std::shared_ptr<const RestShape> shape;
  std::vector<std::int32_t> held;
};

const Case& case_of(std::int64_t vertices) {
  static std::map<std::int64_t, Case> cases;
  return cases.try_emplace(vertices, static_cast<double>(vertices)).first->second;
}

void set_up(benchmark::State& state) {
  const Case& all = case_of(state.range(0));
  const HandleSet handles = creature_turn(all.mesh);
  for (auto _ : state) {
    auto fresh = deformer(rest_shape(all.mesh), handles, Material::uniform(2));
    (void)fresh->start({});
  }
}

void refactor(benchmark::State& state) {
  const Case& all = case_of(state.range(0));
  const HandleSet without = creature_turn(all.mesh);
  HandleSet with = without;
  (void)with.set("patch", {all.held, Fixed{}});
  auto live = deformer(all.shape, without, Material::uniform(2));
  (void)live->start({});
  for (bool is_there = true; auto _ : state) {
    (void)live->set_handles(is_there ? with : without);
    (void)live->start({});
    is_there = !is_there;
  }
  state.counters["patch"] = static_cast<double>(all.held.size());
}

/// A simplicial factor of the Laplacian.
struct Factored {
  explicit Factored(const RestShape& shape) : laplacian(shape) {
    cholmod_start(&common);
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_AMD;
    common.supernodal = CHOLMOD_SIMPLICIAL;
    factor = cholmod_analyze(&laplacian.view, &common);
    cholmod_factorize(&laplacian.view, factor, &common);
  }
  ~Factored() {
    cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }
  Factored(const Factored&) = delete;
  Factored& operator=(const Factored&) = delete;

  Laplacian laplacian;
  cholmod_common common;
  cholmod_factor* factor;
};

void rows(benchmark::State& state) {
  const Case& all = case_of(state.range(0));
  Factored factored(*all.shape);
  cholmod_common& common = factored.common;
  cholmod_factor* const factor = factored.factor;
  for (auto _ : state) {
    state.PauseTiming();
    cholmod_factor* changed = cholmod_copy_factor(factor, &common);
    std::vector<std::int32_t> place(all.mesh.vertices.rows());
    const auto* const old = static_cast<const std::int32_t*>(factor->Perm);
    for (std::size_t k = 0; k < factor->n; ++k) place[old[k]] = static_cast<std::int32_t>(k);
    state.ResumeTiming();
    for (const std::int32_t vertex : all.held)
      cholmod_rowdel(static_cast<std::size_t>(place[vertex]), nullptr, changed, &common);
    state.PauseTiming();
    cholmod_free_factor(&changed, &common);
    state.ResumeTiming();
  }
}

void subtrees(benchmark::State& state) {
  const Case& all = case_of(state.range(0));
  Factored factored(*all.shape);
  cholmod_common& common = factored.common;
  cholmod_factor* const factor = factored.factor;
  cholmod_pack_factor(factor, &common);
  const auto* const old = static_cast<const std::int32_t*>(factor->Perm);
  const auto* const begins = static_cast<const std::int32_t*>(factor->p);
  const auto* const counts = static_cast<const std::int32_t*>(factor->nz);
  const auto* const below = static_cast<const std::int32_t*>(factor->i);
  std::vector<char> is_in_patch(factor->n, 0), is_reached(factor->n, 0);
  for (const std::int32_t vertex : all.held) is_in_patch[vertex] = 1;
  double again = 0, whole = 0;
  for (auto _ : state) {
    again = whole = 0;
    std::fill(is_reached.begin(), is_reached.end(), 0);
    for (std::size_t k = 0; k < factor->n; ++k) {
      const bool is_changed = is_reached[k] || is_in_patch[old[k]];
      const double operations = double(counts[k]) * counts[k];
      whole += operations;
      if (!is_changed) continue;
      again += operations;
      if (counts[k] > 1) is_reached[below[begins[k] + 1]] = 1;  // its parent
    }
  }
  state.counters["share_repeated"] = again / whole;
}

BENCHMARK(set_up)->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond);
BENCHMARK(refactor)->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond);
BENCHMARK(rows)->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond)->Iterations(2);
BENCHMARK(subtrees)->Arg(10000)->Arg(100000)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
}  // namespace lpdeform
