#include <algorithm>
#include <optional>
#include <utility>

#include "core/analysis/automatic_material.h"
#include "core/base/workers.h"
#include "core/library/convert.h"
#include "core/library/core.h"
#include "core/mesh/weld.h"
#include "core/solve/deformer.h"

namespace lpdeform::core {
namespace {

lpdeform::WeightKind converted_weights(WeightKind kind) {
  switch (kind) {
    case WeightKind::kCotangent:
      return lpdeform::WeightKind::kCotangent;
    case WeightKind::kUniform:
      return lpdeform::WeightKind::kUniform;
    case WeightKind::kIntrinsicDelaunay:
      return lpdeform::WeightKind::kIntrinsicDelaunay;
  }
  return lpdeform::WeightKind::kCotangent;
}

lpdeform::FreeComponents converted_components(FreeComponents free) {
  switch (free) {
    case FreeComponents::kError:
      return lpdeform::FreeComponents::kError;
    case FreeComponents::kStay:
      return lpdeform::FreeComponents::kStay;
    case FreeComponents::kFollow:
      return lpdeform::FreeComponents::kFollow;
  }
  return lpdeform::FreeComponents::kError;
}

StopReason converted_reason(lpdeform::StopReason reason) {
  switch (reason) {
    case lpdeform::StopReason::kRunning:
      return StopReason::kRunning;
    case lpdeform::StopReason::kConverged:
      return StopReason::kConverged;
    case lpdeform::StopReason::kIterationLimit:
      return StopReason::kIterationLimit;
    case lpdeform::StopReason::kTimeLimit:
      return StopReason::kTimeLimit;
    case lpdeform::StopReason::kCancelled:
      return StopReason::kCancelled;
    case lpdeform::StopReason::kStalled:
      return StopReason::kStalled;
    case lpdeform::StopReason::kNumericalBreakdown:
      return StopReason::kNumericalBreakdown;
  }
  return StopReason::kRunning;
}

}  // namespace

/// Handles are checked when they are set. The deformer gets them when a solve begins: by then no component may be free.
struct Session::Impl {
  TriangleMesh mesh;
  std::unique_ptr<Deformer> deformer;
  HandleSet handles;
  bool is_changed = false;  // the deformer has other handles

  absl::Status check(const HandleSet& wanted) const {
    return check_handles(wanted, static_cast<std::int32_t>(mesh.vertices.rows()),
                         static_cast<std::int32_t>(mesh.faces.rows()));
  }

  void take(HandleSet wanted) {
    handles = std::move(wanted);
    is_changed = true;
  }

  absl::Status set_all(HandleSet wanted) {
    absl::Status status = check(wanted);
    if (status.ok()) take(std::move(wanted));
    return status;
  }

  absl::Status add(HandleSet& to, std::string_view name, const Handle& handle) const {
    auto own = converted(name, handle, mesh);
    if (!own.ok()) return own.status();
    return to.set(name, *std::move(own));
  }

  absl::Status set_region(HandleSet& to, const std::vector<std::uint32_t>& region) const {
    if (region.empty()) return to.clear_region(), absl::OkStatus();
    for (const std::uint32_t vertex : region) {
      if (vertex >= static_cast<std::uint32_t>(mesh.vertices.rows()))
        return region_vertex_out_of_range(vertex, mesh.vertices.rows());
    }
    to.set_region({region.begin(), region.end()});
    return absl::OkStatus();
  }

  absl::Status start(const SolveOptions& options) {
    if (is_changed || handles.handles().empty()) {
      absl::Status status = deformer->set_handles(handles);
      if (!status.ok()) return status;
      is_changed = false;
    }
    return deformer->start(converted(options), options.stop);
  }
};

Session::Session(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;
Session::~Session() = default;

Result<Session> Session::open(const Mesh& mesh, const OpenOptions& options) {
  auto own = converted(mesh);
  if (!own.ok()) return error_of(own.status());
  const int threads = options.threads == 0 ? available_cores() : options.threads;
  const Workers workers(std::clamp(threads, 1, 1024));
  auto shape = RestShape::create(*own, converted_weights(options.weights), workers);
  if (!shape.ok()) return error_of(shape.status());
  auto deformer = Deformer::create(
      *shape, {.free_components = converted_components(options.free_components), .threads = threads});
  if (!deformer.ok()) return error_of(deformer.status());
  return Session(std::make_unique<Impl>(Impl{*std::move(own), *std::move(deformer), {}}));
}

MeshReport Session::report() const {
  const lpdeform::MeshReport& report = impl_->deformer->shape().report();
  return {report.vertices, report.faces, report.components, report.unreferenced_vertices.count,
          report.split_border_vertices.count};
}

Result<void> Session::set_handle(std::string_view name, const Handle& handle) {
  HandleSet wanted = impl_->handles;
  const absl::Status status = impl_->add(wanted, name, handle);
  return result_of(status.ok() ? impl_->set_all(std::move(wanted)) : status);
}

Result<void> Session::set_handles(const Handles& handles) {
  HandleSet wanted = impl_->handles;
  for (const auto& [name, handle] : impl_->handles.handles()) wanted.remove(name);
  for (const auto& [name, handle] : handles) {
    const absl::Status status = impl_->add(wanted, name, handle);
    if (!status.ok()) return error_of(status);
  }
  return result_of(impl_->set_all(std::move(wanted)));
}

Result<void> Session::move(std::string_view name, const Motion& motion) {
  auto own = converted(name, motion);
  if (!own.ok()) return error_of(own.status());
  const absl::Status status = impl_->handles.set_motion(name, *std::move(own));
  impl_->is_changed |= status.ok();
  return result_of(status);
}

void Session::remove(std::string_view name) {
  impl_->is_changed |= impl_->handles.remove(name);
}

Result<void> Session::set(const Settings& settings) {
  Material material = impl_->deformer->material();
  if (settings.p) material.p = converted(*settings.p);
  if (settings.stiffness) material.stiffness = converted(*settings.stiffness);
  if (settings.length_unit) material.length_unit = *settings.length_unit;
  HandleSet wanted = impl_->handles;
  absl::Status status;
  if (settings.region) {
    status = impl_->set_region(wanted, *settings.region);
    status.Update(impl_->check(wanted));
  }
  if (status.ok()) status = impl_->deformer->set_material(material);
  if (status.ok() && settings.region) impl_->take(std::move(wanted));
  return result_of(status);
}

Result<Settings> Session::automatic(double strength) const {
  const auto material = automatic_material(impl_->deformer->shape(), strength);
  if (!material.ok()) return error_of(material.status());
  return Settings{.p = numbers_of(material->p), .stiffness = numbers_of(material->stiffness)};
}

Result<void> Session::set_positions(const std::vector<double>& positions) {
  const auto own = points_of(positions, impl_->deformer->shape().vertex_count());
  return result_of(own.ok() ? impl_->deformer->set_positions(*own) : own.status());
}

Result<void> Session::start(const SolveOptions& options) {
  return result_of(impl_->start(options));
}

bool Session::step() {
  return impl_->deformer->step();
}

Result<SolveResult> Session::solve(const SolveOptions& options) {
  const absl::Status status = impl_->start(options);
  if (!status.ok()) return error_of(status);
  bool is_running = true;
  while (is_running) {
    is_running = impl_->deformer->step();
    const SolveSummary& summary = impl_->deformer->summary();
    if (options.on_progress) options.on_progress({summary.iterations, summary.energy, summary.solve_seconds});
  }
  return result();
}

SolveResult Session::result() const {
  const Deformer& deformer = *impl_->deformer;
  const SolveSummary& summary = deformer.summary();
  return {numbers_of(deformer.positions()),
          numbers_of(deformer.cell_energies()),
          converted_reason(summary.stop_reason),
          summary.iterations,
          summary.energy,
          summary.soft_energy,
          summary.optimality_gap,
          summary.setup_seconds,
          summary.solve_seconds,
          deformer.shape().report().split_border_vertices.count,
          summary.minima,
          summary.further_starts,
          summary.search_iterations,
          summary.effort};
}

Result<SolveResult> deform(const Mesh& mesh, const Handles& handles, const Settings& settings,
                           const SolveOptions& options, const OpenOptions& open_options) {
  Result<Session> session = Session::open(mesh, open_options);
  if (!session) return session.error();
  if (const auto done = session->set_handles(handles); !done) return done.error();
  if (const auto done = session->set(settings); !done) return done.error();
  return session->solve(options);
}

Result<WeldedMesh> weld(const Mesh& mesh, double tolerance) {
  const auto own = converted(mesh);
  if (!own.ok()) return error_of(own.status());
  const auto weld = weld_by_position(own->vertices, tolerance);
  if (!weld.ok()) return error_of(weld.status());
  return WeldedMesh{given_back(welded(*own, *weld)), {weld->to_welded.begin(), weld->to_welded.end()}};
}

const char* version() {
  return LPDEFORM_VERSION;
}

}  // namespace lpdeform::core
